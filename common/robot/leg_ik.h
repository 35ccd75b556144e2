#pragma once
#include "common/robot/biped.h"
#include "common/robot/kinematics.h"

namespace mimesis::robot {

/// Inverse kinematics of a leg of six revolute joints: three in the hip, a knee, two in the ankle.
/// No allocation; same inputs, same bits.
///
/// Closed form where three axes meet in the hip in any order of x, y and z, the knee turns about y,
/// and two axes meet in the ankle in either order; offsets along y at hip and knee, and of the knee
/// along x, allowed. The distance from hip to ankle gives the knee (law of cosines), the direction
/// of the hip as the foot sees it the ankle, the rotation that is left the hip. Ankle and hip have
/// two solutions each: the hip above the ankle and least turned, or the other if that alone keeps
/// the limits.
///
/// Every other leg (axes that miss each other or are askew) by damped Newton steps from a posture
/// nearby [Sugihara 2011], down to rounding. The knee stays on its side: where it would leave its
/// range it is held, and the distance that is missing is the unknown in its place.
class LegIk {
 public:
  /// @throws ConfigError that names the knee if it does not bend, or not between hip and ankle
  LegIk(const Biped& biped, Side side);

  using Vector6d = Eigen::Matrix<double, 6, 1>;
  struct Result {
    Vector6d q;  ///< in the order of Biped::Leg::dof
    /// The target is farther than the leg is long, or nearer than the knee bends: q points at it
    /// with the knee at `least_knee_bend_rad` from straight or its limit, the sole turned as asked.
    /// Also if no posture was found from `near`, nor from half-sitting.
    bool stretched = false;
    bool limited = false;   ///< a joint was cut to its limit
    double bend_rad = 0.0;  ///< angle of the knee from straight, ≥ 0
  };
  /// `X_BS`: sole in the pelvis. `near`: where to begin without a closed form, say the last result;
  /// null: half-sitting.
  Result solve(const Eigen::Isometry3d& X_BS, double least_knee_bend_rad = 0.01,
               const Vector6d* near = nullptr) const;
  bool closed_form() const { return closed_; }

 private:
  bool fits_closed_form() const;
  Result solve_closed(const Eigen::Isometry3d& X_BS, double least_bend_rad) const;
  Result search(const Eigen::Isometry3d& X_BS, double least_bend_rad, const Vector6d& from) const;
  /// Knee so that hip and ankle are `distance_m` apart, and where the hip then is as seen from the
  /// ankle, in the shank's axes.
  Eigen::Vector3d bend_knee(double distance_m, double least_bend_rad, Result& out) const;
  /// Ankle that turns `hip_F` (ankle to hip as the foot sees it) to `hip_K` (as the shank does);
  /// `lesser`: with the lesser of two rolls.
  void turn_ankle(const Eigen::Vector3d& hip_F, const Eigen::Vector3d& hip_K, bool lesser,
                  Result& out) const;
  void turn_hip(const Eigen::Matrix3d& R_BT, Result& out) const;
  void apply_limits(Result& out) const;

  bool closed_ = false;
  std::array<Line, 6> line_;  ///< axes in the zero posture, in B
  Vector6d half_sitting_;     ///< [rad]
  Eigen::Vector3d ankle_B_;   ///< in the zero posture [m]
  Eigen::Vector3d hip_B_;     ///< [m]
  Eigen::Vector3d thigh_B_;   ///< hip to knee in the zero posture [m]
  Eigen::Vector3d shank_B_;   ///< knee to ankle in the zero posture [m]
  Eigen::Vector3d ankle_S_;   ///< [m]
  Eigen::Matrix3d R_SB_;      ///< sole in the zero posture
  std::array<int, 6> axis_;   ///< 0, 1, 2: x, y, z
  Vector6d sense_;            ///< +1 or −1: along that axis or against it
  Vector6d lower_, upper_;    ///< [rad]
  double straight_ = 0.0;     ///< turn of the knee at which the leg is longest [rad]
  double bends_ = 1.0;        ///< sense of bending, ±1
  double most_bend_ = 0.0;    ///< from straight to the limit [rad]
  double lengths_2_ = 0.0;    ///< squares of thigh and shank across the knee's axis [m²]
  double product_ = 0.0;      ///< product of thigh and shank, both across the knee's axis [m²]
};

}  // namespace mimesis::robot
