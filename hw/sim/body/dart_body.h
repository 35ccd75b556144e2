#pragma once
#include "hw/sim/body/body_world.h"

namespace dart::dynamics {
class BodyNode;
class DegreeOfFreedom;
class Skeleton;
}  // namespace dart::dynamics
namespace dart::simulation {
class World;
}

namespace mimesis::hw::sim {

/// Where DART keeps a link: frames that weigh nothing hang on the body that carries them.
struct DartLink {
  dart::dynamics::BodyNode* node = nullptr;
  Eigen::Isometry3d X_NL = Eigen::Isometry3d::Identity();
};

/// A biped and the ground as DART has them. Private to BodyWorld: nobody else includes it.
struct DartBody {
  std::shared_ptr<dart::simulation::World> world;
  std::shared_ptr<dart::dynamics::Skeleton> robot;
  std::vector<dart::dynamics::DegreeOfFreedom*> dof;   ///< in the order of RobotTree
  std::vector<DartLink> link;                          ///< likewise
  Eigen::Matrix3d R_WG = Eigen::Matrix3d::Identity();  ///< z of the ground is its normal

  const DartLink& at(int index) const { return link[static_cast<std::size_t>(index)]; }
  Eigen::Isometry3d X_WL(int index) const;
  /// Of the link's origin, in W.
  Eigen::Vector3d velocity(int index) const;
  Eigen::Isometry3d X_WB() const;
};

/// Robot, ground and plates, the robot standing half-sitting. @throws ConfigError
DartBody make_dart_body(const robot::Biped& biped, const std::string& urdf_file,
                        const BodyOptions& options);

}  // namespace mimesis::hw::sim
