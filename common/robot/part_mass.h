#pragma once
#include <span>

#include "common/robot/bodies.h"

namespace mimesis::robot {

/// Mass of a part of a robot, say a leg: all that some joints move, with or without the root link.
/// Cheaper than the whole where one part moves alone. No allocation after construction.
class PartMass {
 public:
  /// `dofs`: with every joint all between it and the root.
  PartMass(const RobotTree& tree, std::span<const int> dofs, bool with_root);
  double mass_kg() const { return mass_; }
  /// mass · CoM in the root's frame [kg m]; `q`: joints in the order of `dofs`.
  Eigen::Vector3d first_moment(const Eigen::Ref<const Eigen::VectorXd>& q);

 private:
  std::vector<Body> bodies_;         ///< parent: index here, or −1: the root
  std::vector<Eigen::Index> joint_;  ///< of every body, index into q
  std::vector<Eigen::Vector3d> moment_;
  Eigen::Vector3d root_ = Eigen::Vector3d::Zero();
  double mass_ = 0.0;
};

}  // namespace mimesis::robot
