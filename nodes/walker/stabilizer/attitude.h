#pragma once
#include <Eigen/Geometry>
#include <algorithm>

#include "common/math/so3.h"
#include "nodes/walker/stabilizer/settings.h"

namespace mimesis::walker {

/// Attitude of the IMU from its gyro ω and accelerometer f: complementary filter on SO(3) that
/// estimates the gyro's bias b [Mahony, Hamel, Pflimlin 2008; docs/walking.md eq. 6.8]. With the
/// known acceleration a of the IMU and ĝ = R̂ᵀ ẑ,
///   R̂' = R̂ [ω − b̂ + k e]×,  b̂' = −l e,  e = (f − a)/|f − a| × ĝ
/// so that errors of tilt decay as ε̈ + k ε̇ + l ε = 0. The heading is that of the start and drifts.
/// k = 4/T, l = 6/T² are the gains of a line fitted to all readings of the last T; e passes a low
/// pass of 0.1 s first.
class AttitudeFilter {
 public:
  /// @param forget_s  T; until it has passed, T grows with the time since the start
  explicit AttitudeFilter(double forget_s) : forget_s_(forget_s) {}

  void reset() { age_s_ = 0.0; }
  /// @param acceleration_I  known acceleration of the IMU [m/s²], in its frame
  /// @return R_WI after this reading. No allocation. Precondition: finite numbers.
  const Eigen::Quaterniond& step(const Eigen::Vector3d& gyro_I, const Eigen::Vector3d& felt_I,
                                 const Eigen::Vector3d& acceleration_I, double dt_s) {
    if (age_s_ > 0.0) turn(dt_s * (gyro_I - bias_I_));
    const Eigen::Vector3d up_I = felt_I - acceleration_I;
    if (up_I.norm() < kLeast_m_s2) return R_WI_;  // it falls freely: nothing is upright
    if (age_s_ == 0.0) {
      R_WI_ = Eigen::Quaterniond(math::rotation_onto(up_I, Eigen::Vector3d::UnitZ()));
      bias_I_.setZero();
      off_W_.setZero();
      age_s_ = std::min(kStart_s, forget_s_);
      return R_WI_;
    }
    // e in W: there it does not turn with the robot, and can be smoothed
    const Eigen::Vector3d e_W = (R_WI_ * up_I).normalized().cross(Eigen::Vector3d::UnitZ());
    off_W_ += low_pass_share(kSmooth_s) * (e_W - off_W_);
    const double off = off_W_.norm();
    const Eigen::Vector3d e = R_WI_.conjugate() * off_W_ * (off > kMost ? kMost / off : 1.0);
    turn(dt_s * 4.0 / age_s_ * e);  // [eq. 6.8]
    bias_I_ -= dt_s * 6.0 / (age_s_ * age_s_) * e;
    age_s_ = std::min(age_s_ + dt_s, forget_s_);
    return R_WI_;
  }
  const Eigen::Quaterniond& R_WI() const { return R_WI_; }
  const Eigen::Vector3d& gyro_bias_I() const { return bias_I_; }

 private:
  static constexpr double kLeast_m_s2 = 1.0;
  /// Low pass of e: a foot that lands shakes the accelerometer far more than the robot tilts.
  static constexpr double kSmooth_s = 0.1;
  /// Limit of e: more is a push, not a tilt. It does not save a robot that 15 N s push from the
  /// front at a stand [docs/walking.md 6.8].
  static constexpr double kMost = 0.02;
  /// T at the start: a bias of a usual gyro is small, so that no line through few readings is
  /// trusted to show it.
  static constexpr double kStart_s = 2.0;

  void turn(const Eigen::Vector3d& by_I) {
    R_WI_ = (R_WI_ * Eigen::Quaterniond(math::exp_so3(by_I))).normalized();
  }

  double forget_s_, age_s_ = 0.0;
  Eigen::Quaterniond R_WI_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d bias_I_ = Eigen::Vector3d::Zero(), off_W_ = Eigen::Vector3d::Zero();
};

/// Acceleration of a point that is sent to known places, once a tick: second difference through a
/// low pass.
class PlannedAcceleration {
 public:
  explicit PlannedAcceleration(double filter_s) : share_(low_pass_share(filter_s)) {}

  void reset() { known_ = 0; }
  /// @return [m/s²]
  const Eigen::Vector3d& step(const Eigen::Vector3d& p_W_m) {
    const Eigen::Vector3d v = (p_W_m - last_p_) / kTick_s;
    if (known_ < 2) a_.setZero();
    if (known_ >= 2) a_ += share_ * ((v - last_v_) / kTick_s - a_);
    known_ = std::min(known_ + 1, 2);
    last_p_ = p_W_m;
    last_v_ = v;
    return a_;
  }

 private:
  double share_;
  int known_ = 0;  ///< of the last place and the last velocity
  Eigen::Vector3d last_p_ = Eigen::Vector3d::Zero(), last_v_ = Eigen::Vector3d::Zero(),
                  a_ = Eigen::Vector3d::Zero();
};

}  // namespace mimesis::walker
