#pragma once
#include "common/robot/biped.h"

namespace mimesis::robot {

/// Closed-form inverse kinematics of a leg of six revolute joints: three axes that meet in the hip
/// in any order of x, y and z, a knee, two that meet in the ankle in either order; offsets along
/// y at hip and knee allowed. No allocation.
class LegIk {
 public:
  /// @throws ConfigError that says which joint does not fit
  LegIk(const Biped& biped, Side side);

  struct Result {
    Eigen::Matrix<double, 6, 1> q;  ///< in the order of Biped::Leg::dof
    /// The target is farther than the leg is long, or nearer than the knee bends: q points at it
    /// with the knee at `least_knee_bend_rad` or its limit.
    bool stretched = false;
    bool limited = false;  ///< a joint was cut to its limit
  };
  /// `X_BS`: sole in the pelvis.
  Result solve(const Eigen::Isometry3d& X_BS, double least_knee_bend_rad = 0.01) const;

 private:
  // helper
};

}  // namespace mimesis::robot
