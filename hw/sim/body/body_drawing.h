#pragma once
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "common/robot/kinematics.h"
#include "common/robot/link_shapes.h"
#include "hw/sim/body/body_world.h"
#include "hw/sim/body/drawer.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/foxglove/transform.pb.h"

namespace mimesis::hw::sim {

/// The simulated body and its furniture for viewers: shapes on frames named after the links, sent
/// once and moved by transforms; forces, CoM and ZMP.
class BodyDrawing {
 public:
  /// `drawer`: empty: no furniture. @throws ConfigError if the URDF cannot be read
  BodyDrawing(const robot::Biped& biped, const std::string& urdf_file,
              const std::optional<DrawerSettings>& drawer);

  foxglove::SceneUpdate shapes(std::chrono::nanoseconds now) const;
  /// `q`: dof [rad]
  foxglove::FrameTransforms frames(const BodyTruth& truth, const Eigen::VectorXd& q,
                                   const DrawerNow* drawer, std::chrono::nanoseconds now);
  /// Forces of the ground as arrows of 1 m for 1000 N; CoM with its place on the ground; ZMP.
  static foxglove::SceneUpdate forces(const BodyTruth& truth, std::chrono::nanoseconds now);

 private:
  robot::Biped biped_;
  robot::Kinematics kinematics_;
  std::vector<robot::LinkShape> shapes_;
  std::vector<int> drawn_;  ///< links with shapes, and the root
  std::optional<DrawerSettings> drawer_;
};

}  // namespace mimesis::hw::sim
