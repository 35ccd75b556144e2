#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <optional>

#include "common/math/so3.h"
#include "common/robot/dynamics.h"

namespace mimesis::walker {

/// Attitude of the IMU from its gyro ω, its accelerometer f and its velocity v by the kinematics of
/// the standing feet: complementary filter on SO(3) that estimates the gyro's bias b [Mahony,
/// Hamel, Pflimlin 2008], with the velocity in the place of an unknown acceleration [Benallegue et
/// al. 2020; docs/walking.md eq. 6.8]:
///   x̂' = R̂ f − g ẑ + α (v − x̂),  e = α/g (x̂ − v) × ẑ
///   R̂' = R̂ [ω − b̂ + k R̂ᵀ e]×,  b̂' = −l R̂ᵀ e
/// A tilt of R̂ makes R̂ f − g ẑ differ from v̇; e is that difference through a low pass of 1/α = 0.1
/// s, and errors of tilt decay as ε̈ + k ε̇ + l ε = 0. The heading is that of the start and drifts.
/// k = 4/T, l = 6/T² are the gains of a line fitted to all readings of the last T.
class AttitudeFilter {
 public:
  /// Motion of the IMU in its frame by the encoders, from feet that stand.
  struct Seen {
    Eigen::Vector3d v_I, rate_I;
  };
  /// @param forget_s  T; until it has passed, T grows with the time since the start
  explicit AttitudeFilter(double forget_s) : forget_s_(forget_s) {}

  void reset() { age_s_ = 0.0; }
  /// One reading of the IMU, and what else is known of its motion.
  struct Reading {
    Eigen::Vector3d gyro_I, felt_I;
    std::optional<Seen> seen;  ///< nothing: no foot stands
    bool rests = false;        ///< on both feet: at the start the gyro shows its bias
  };
  /// @return R_WI after this reading. No allocation. Precondition: finite numbers.
  const Eigen::Quaterniond& step(const Reading& now, double dt_s) {
    if (age_s_ == 0.0) {
      if (now.felt_I.norm() < kLeast_m_s2) return R_WI_;  // it falls freely: nothing is upright
      R_WI_ = Eigen::Quaterniond(math::rotation_onto(now.felt_I, Eigen::Vector3d::UnitZ()));
      bias_I_.setZero();
      moves_ = false;
      age_s_ = std::min(kStart_s, forget_s_);
    } else {
      turn(dt_s * (now.gyro_I - bias_I_));
    }
    const bool knows = now.seen.has_value();
    if (knows && now.rests && age_s_ < kStart_s + kRest_s) {
      bias_I_ += dt_s / kRestMean_s * (now.gyro_I - now.seen->rate_I - bias_I_);
    }
    if (knows && moves_) correct(now, dt_s);
    if (knows && !moves_) v_W_ = R_WI_ * now.seen->v_I;
    moves_ = knows;
    return R_WI_;
  }
  const Eigen::Quaterniond& R_WI() const { return R_WI_; }
  const Eigen::Vector3d& gyro_bias_I() const { return bias_I_; }

 private:
  static constexpr double kLeast_m_s2 = 1.0;
  static constexpr double kVelocity_1_s = 10.0;  ///< α
  /// T at the start: a bias of a usual gyro is small, so that no line through few readings is
  /// trusted to show it.
  static constexpr double kStart_s = 2.0;
  /// A robot that stands for so long after the start takes the mean of the last second as the bias.
  static constexpr double kRest_s = 3.0, kRestMean_s = 1.0;

  void correct(const Reading& now, double dt_s) {
    const Eigen::Vector3d ahead_W = v_W_ - R_WI_ * now.seen->v_I;
    v_W_ += dt_s * (R_WI_ * now.felt_I - robot::kGravity * Eigen::Vector3d::UnitZ() -
                    kVelocity_1_s * ahead_W);
    const Eigen::Vector3d e = R_WI_.conjugate() * (kVelocity_1_s / robot::kGravity *
                                                   ahead_W.cross(Eigen::Vector3d::UnitZ()));
    turn(dt_s * 4.0 / age_s_ * e);  // [eq. 6.8]
    bias_I_ -= dt_s * 6.0 / (age_s_ * age_s_) * e;
    age_s_ = std::min(age_s_ + dt_s, forget_s_);
  }
  void turn(const Eigen::Vector3d& by_I) {
    R_WI_ = (R_WI_ * Eigen::Quaterniond(math::exp_so3(by_I))).normalized();
  }

  double forget_s_, age_s_ = 0.0;
  bool moves_ = false;  ///< v_W_ is known
  Eigen::Quaterniond R_WI_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d bias_I_ = Eigen::Vector3d::Zero(), v_W_ = Eigen::Vector3d::Zero();  ///< b̂, x̂
};

}  // namespace mimesis::walker
