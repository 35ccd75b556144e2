#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>

#include "common/robot/robot_tree.h"

namespace mimesis::robot {

/// 6 × (6 + dof). Rows 0-2 linear, 3-5 angular. Columns 0-2: velocity of the base's origin, 3-5:
/// angular velocity of the base, both in W; then one a joint.
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// Where the robot's links are. Allocates when it is made, not later. The tree outlives it.
class Kinematics {
 public:
  explicit Kinematics(const RobotTree& tree);

  /// `X_WB`: pose of the root link; `q`: dof, [rad] or [m].
  void update(const Eigen::Isometry3d& X_WB, const Eigen::Ref<const Eigen::VectorXd>& q);

  const RobotTree& tree() const { return *tree_; }
  const Eigen::Isometry3d& X_WL(int link) const { return X_WL_[static_cast<std::size_t>(link)]; }
  /// Centre of mass of all links in W [m]. Precondition: the robot has a mass.
  Eigen::Vector3d com() const;
  /// Velocity in W of the point of link L that is now at `p_W`, and angular velocity of L, per
  /// generalised velocity (see Jacobian). `out` is 6 × (6 + dof).
  void jacobian(int link, const Eigen::Vector3d& p_W, Eigen::Ref<Jacobian> out) const;

 private:
  const RobotTree* tree_;
  std::vector<Eigen::Isometry3d> X_WL_;
  Eigen::Matrix3Xd axis_W_;  ///< axis of every dof
};

/// A joint's axis as a line in space.
struct Line {
  Eigen::Vector3d point, direction;  ///< [m]; unit vector
};

/// The point that all lines go through within `tolerance_m`; nothing if there is none or all lines
/// are parallel.
std::optional<Eigen::Vector3d> meeting_point(std::span<const Line> lines,
                                             double tolerance_m = 1e-6);

}  // namespace mimesis::robot
