#pragma once
#include "common/robot/biped.h"

namespace mimesis::robot {

/// Closed-form inverse kinematics of a leg of six revolute joints: three axes that meet in the hip
/// in any order of x, y and z, a knee, two that meet in the ankle in either order; offsets along
/// y at hip and knee, and of the knee along x, allowed. Axes are those of the zero posture, along
/// the pelvis's x, y or z in either sense. No allocation.
///
/// The distance from hip to ankle gives the knee (law of cosines), the direction of the hip as the
/// foot sees it the ankle, the rotation that is left the hip. Ankle and hip have two solutions
/// each: the hip above the ankle and least turned, or the other if that alone keeps the limits.
class LegIk {
 public:
  /// @throws ConfigError that names the joint that does not fit
  LegIk(const Biped& biped, Side side);

  using Vector6d = Eigen::Matrix<double, 6, 1>;
  struct Result {
    Vector6d q;  ///< in the order of Biped::Leg::dof
    /// The target is farther than the leg is long, or nearer than the knee bends: q points at it
    /// with the knee at `least_knee_bend_rad` from straight or its limit, the sole turned as asked.
    bool stretched = false;
    bool limited = false;   ///< a joint was cut to its limit
    double bend_rad = 0.0;  ///< angle of the knee from straight, ≥ 0
  };
  /// `X_BS`: sole in the pelvis.
  Result solve(const Eigen::Isometry3d& X_BS, double least_knee_bend_rad = 0.01) const;

 private:
  /// Knee so that hip and ankle are `distance_m` apart, and where the hip then is as seen from the
  /// ankle, in the shank's axes.
  Eigen::Vector3d bend_knee(double distance_m, double least_bend_rad, Result& out) const;
  /// Ankle that turns `hip_F` (ankle to hip as the foot sees it) to `hip_K` (as the shank does);
  /// `lesser`: with the lesser of two rolls.
  void turn_ankle(const Eigen::Vector3d& hip_F, const Eigen::Vector3d& hip_K, bool lesser,
                  Result& out) const;
  void turn_hip(const Eigen::Matrix3d& R_BT, Result& out) const;
  void apply_limits(Result& out) const;

  Eigen::Vector3d hip_B_;    ///< [m]
  Eigen::Vector3d thigh_B_;  ///< hip to knee in the zero posture [m]
  Eigen::Vector3d shank_B_;  ///< knee to ankle in the zero posture [m]
  Eigen::Vector3d ankle_S_;  ///< [m]
  Eigen::Matrix3d R_SB_;     ///< sole in the zero posture
  std::array<int, 6> axis_;  ///< 0, 1, 2: x, y, z
  Vector6d sense_;           ///< +1 or −1: along that axis or against it
  Vector6d lower_, upper_;   ///< [rad]
  double straight_ = 0.0;    ///< turn of the knee at which the leg is longest [rad]
  double bends_ = 1.0;       ///< sense of bending, ±1
  double most_bend_ = 0.0;   ///< from straight to the limit [rad]
  double lengths_2_ = 0.0;   ///< squares of thigh and shank across the knee's axis [m²]
  double product_ = 0.0;     ///< product of thigh and shank, both across the knee's axis [m²]
};

}  // namespace mimesis::robot
