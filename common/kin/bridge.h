#pragma once
#include <vector>

#include "common/kin/table.h"

namespace mimesis::kin {

/// The obstacle of the bridge paradigm [M18 2.1.1]: two posts and a bar across them, all of one
/// thickness, in the plane x = const of W.
struct BridgeShape {
  double x = 0.0;            ///< of the plane [m]
  double surface_z = 0.0;    ///< of the table top [m]
  double half_width = 0.0;   ///< posts stand at y = ±half_width [m]
  double height = 0.0;       ///< lower edge of the bar above the table top [m]
  double ball_radius = 0.0;  ///< half the thickness [m]
  /// Between neighbouring ball centres [m]. The balls cover a rod of radius √(ball_radius² − ¼
  /// max_spacing²).
  double max_spacing = 0.0;
};

/// The bridge as a union of safety balls [M18 2.3.2], evenly spaced along posts and bar. The lowest
/// ball of a post rests on the table top.
std::vector<Ball> bridge_balls(const BridgeShape& shape);

/// Middle of the bar's axis in W [m].
Eigen::Vector3d bar_center(const BridgeShape& shape);

}  // namespace mimesis::kin
