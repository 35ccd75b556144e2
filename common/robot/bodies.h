#pragma once
#include <span>
#include <vector>

#include "common/robot/robot_tree.h"

namespace mimesis::robot {

/// A link that a joint moves, with all that is fixed to it. Its frame is the link's, turned so that
/// the joint's axis is its z axis: turning by q is then the same few operations for every joint.
struct Body {
  int link = 0;
  int parent = -1;                                     ///< body
  bool slides = false;                                 ///< along z, instead of turning about it
  Eigen::Matrix3d R_PJ = Eigen::Matrix3d::Identity();  ///< at q = 0; P: frame of the parent body
  Eigen::Vector3d p_PJ = Eigen::Vector3d::Zero();      ///< [m]
  double mass = 0.0;                                   ///< [kg]
  Eigen::Vector3d first = Eigen::Vector3d::Zero();     ///< mass · CoM [kg m]
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();   ///< about the frame's origin [kg m²]
  /// mass of the link and of all links it carries [kg]
  double subtree_mass = 0.0;
  Eigen::Vector3d first_L = Eigen::Vector3d::Zero();  ///< mass · CoM in the link's frame [kg m]
  Eigen::Vector3d axis_L = Eigen::Vector3d::UnitZ();  ///< axis of the joint in the link's frame
};

/// The root as body 0, then one a joint: joint d moves body d + 1. Parents come first.
std::vector<Body> bodies_of(const RobotTree& tree);

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
  std::vector<Eigen::Index> joint_;  ///< index into q, for every body
  std::vector<Eigen::Vector3d> moment_;
  Eigen::Vector3d root_ = Eigen::Vector3d::Zero();
  double mass_ = 0.0;
};

}  // namespace mimesis::robot
