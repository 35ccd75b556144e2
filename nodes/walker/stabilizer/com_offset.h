#pragma once
#include <algorithm>

#include "nodes/walker/stabilizer/settings.h"

namespace mimesis::walker {

/// Constant error of the measured CoM: a tilt of what the IMU takes for upright, masses that the
/// model does not know, a load in the hand. The pendulum c̈ = ω² (c − z) holds for the true c, and
/// the measured ZMP z does not depend on the attitude, so [docs/walking.md eq. 6.10]
///   o = ⟨c − z − c̈/ω²⟩
/// over the last T, along and across the heading. The mean of the rate of angular momentum, which
/// the pendulum neglects, is 0. A push is no offset: what differs from o by more than a limit
/// counts as the limit. A Kalman filter with the same model is in JRL's state-observation.
class ComOffset {
 public:
  ComOffset(double omega_1_s, const StabilizerSettings& settings)
      : settings_(&settings), per_omega2_(1.0 / (omega_1_s * omega_1_s)) {}

  void reset() { age_s_ = 0.0, offset_H_.setZero(), lost(); }
  /// The next measurement does not follow the last one.
  void lost() { follows_ = false; }
  /// Once a tick with the measured CoM, its velocity and the ZMP of the same instant [m, W].
  void measure(const Eigen::Vector2d& com_W, const Eigen::Vector2d& v_W,
               const Eigen::Vector2d& zmp_W, double yaw_rad) {
    if (!follows_) slow_W_ = com_W - zmp_W, slow_v_W_ = v_W;
    follows_ = true;
    constexpr double kShare = kTick_s / kSmooth_s;
    slow_W_ += kShare * (com_W - zmp_W - slow_W_);
    // the low pass of c̈ is the rest of the high pass of ċ
    const Eigen::Vector2d a_W = (v_W - slow_v_W_) / kSmooth_s;
    slow_v_W_ += kTick_s * a_W;
    if (settings_->com_offset_s <= 0.0) return;
    age_s_ = std::min(age_s_ + kTick_s, settings_->com_offset_s);
    Eigen::Vector2d off = Eigen::Rotation2Dd(-yaw_rad) * (slow_W_ - per_omega2_ * a_W) - offset_H_;
    const double norm = off.norm();
    if (norm > kMost_m) off *= kMost_m / norm;
    offset_H_ += kTick_s / std::max(age_s_, kStart_s) * off;
  }
  Eigen::Vector2d offset_W_m(double yaw_rad) const {
    return Eigen::Rotation2Dd(yaw_rad) * offset_H_;
  }

 private:
  static constexpr double kSmooth_s = 0.1, kStart_s = 2.0, kMost_m = 0.03;

  const StabilizerSettings* settings_;
  double per_omega2_, age_s_ = 0.0;
  bool follows_ = false;
  Eigen::Vector2d offset_H_ = Eigen::Vector2d::Zero(), slow_W_, slow_v_W_;
};

}  // namespace mimesis::walker
