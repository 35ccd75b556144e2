#pragma once
#include "hw/sim/body/dart_body.h"

namespace mimesis::hw::sim {

/// What the ground does to the soles in one step of the world.
struct GroundContact {
  std::array<robot::Wrench, 2> foot_S;                   ///< about the sole's origin, in S
  Eigen::Vector2d weighted_W = Eigen::Vector2d::Zero();  ///< sum of p·f_z over the contacts
  double vertical_n = 0.0;                               ///< sum of f_z
};

/// Reads the contacts of the last step. `X_WS`: soles before that step, where DART looked for them.
GroundContact read_contacts(const DartBody& body, const robot::Biped& biped,
                            const std::array<Eigen::Isometry3d, 2>& X_WS);

}  // namespace mimesis::hw::sim
