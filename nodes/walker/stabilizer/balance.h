#pragma once
#include "common/robot/dynamics.h"
#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/stabilizer/settings.h"

namespace mimesis::walker {

/// Feedback of the divergent component of motion ξ = c + ċ/ω, ω = √(g/h) [C19; docs/walking.md
/// eq. 6.1]. For the error e = ξ − ξ_r the wished ZMP is z_d = z_r + (1 + kd/ω) e + (ki/ω) ∫e, so
/// that the linear inverted pendulum ξ̇ = ω (ξ − z) has ė = −kd e − ki ∫e.
class DcmFeedback {
 public:
  DcmFeedback(double com_height_m, const StabilizerSettings& settings)
      : settings_(&settings), omega_(std::sqrt(robot::kGravity / com_height_m)) {}

  void reset() {
    error_.setZero();
    integral_.setZero();
  }
  void measure(const ComState& planned, const Eigen::Vector2d& com_W_m,
               const Eigen::Vector2d& com_v_W) {
    error_ = com_W_m - planned.p_W_m + (com_v_W - planned.v_W) / omega_;
  }
  /// @return z_d − z_r. `saturated`: the last one was cut; ∫e only forgets. Along the heading
  /// `yaw_rad` the term of kd is limited (forward_limit_m).
  Eigen::Vector2d step(bool saturated, double yaw_rad) {
    const StabilizerSettings& s = *settings_;
    for (int i = 0; i < 2; ++i) {
      integral_[i] =
          leaky(integral_[i], saturated ? 0.0 : error_[i], s.integral_leak_s, s.integral_limit);
    }
    // z_d − z_r = e + (kd/ω) e + (ki/ω) ∫e, the second term limited along the heading    [eq. 6.1]
    const Eigen::Vector2d ahead(std::cos(yaw_rad), std::sin(yaw_rad));
    Eigen::Vector2d beyond = s.kd_1_s / omega_ * error_;
    const double along = ahead.dot(beyond);
    beyond += (std::clamp(along, -s.forward_limit_m, s.forward_limit_m) - along) * ahead;
    return error_ + beyond + s.ki_1_s / omega_ * integral_;
  }

  const Eigen::Vector2d& error_m() const { return error_; }
  double omega_1_s() const { return omega_; }

 private:
  const StabilizerSettings* settings_;
  double omega_;
  Eigen::Vector2d error_ = Eigen::Vector2d::Zero(), integral_ = Eigen::Vector2d::Zero();
};

/// CoM admittance: shift x of the CoM that brings the measured ZMP to the wished one
/// [C19; docs/walking.md eq. 6.2], ẍ = k (z − z_d) − 2 ẋ/T − x/T², |x| limited.
class ComAdmittance {
 public:
  explicit ComAdmittance(const StabilizerSettings& settings) : settings_(&settings) {}

  void reset() { shift_.setZero(), rate_.setZero(); }
  const Eigen::Vector2d& step(const Eigen::Vector2d& zmp_m, const Eigen::Vector2d& wished_zmp_m) {
    const StabilizerSettings& s = *settings_;
    const double T = s.com_leak_s;
    // ẍ = k (z − z_d) − 2 ẋ/T − x/T²                                                      [eq. 6.2]
    rate_ += kTick_s * (s.com_1_s2 * (zmp_m - wished_zmp_m) - 2.0 / T * rate_ - shift_ / (T * T));
    for (int i = 0; i < 2; ++i) {
      const double free = shift_[i] + kTick_s * rate_[i];
      shift_[i] = std::clamp(free, -s.com_limit_m, s.com_limit_m);
      if (shift_[i] != free) rate_[i] = 0.0;  // no wind-up at the limit
    }
    return shift_;
  }
  const Eigen::Vector2d& shift_m() const { return shift_; }
  const Eigen::Vector2d& rate_m_s() const { return rate_; }

 private:
  const StabilizerSettings* settings_;
  Eigen::Vector2d shift_ = Eigen::Vector2d::Zero(), rate_ = Eigen::Vector2d::Zero();
};

/// Moves landings when the soles are too small for a push [Englsberger, Ott, Albu-Schäffer 2015;
/// docs/walking.md eq. 6.7]. While the wished ZMP is cut to z_r + d, the error e of the divergent
/// component grows until the landing in t to
///   e_T = (e − d) exp(ω t) + d,
/// along and across the heading, less the share of noise in e, without changing sign: where d
/// exceeds e the soles suffice. A foot that lands e_T further removes the error if the whole
/// pattern continues from there, so the pattern moves by the offset of the foot that has landed.
/// The other foot keeps its place, as an offset from the moved pattern, until its next swing; the
/// wished CoM follows the pattern slowly.
///
/// Protocol: step() returns how far to move the pattern; the plan of the next tick has moved.
class StepAdjustment {
 public:
  explicit StepAdjustment(const StabilizerSettings& settings)
      : settings_(&settings), share_(low_pass_share(settings.adjust_filter_s)) {
    reset();
  }

  void reset() {
    foot_.fill(Eigen::Vector2d::Zero()), touch_W_.fill(Eigen::Vector2d::Zero());
    in_air_.fill(false);
    com_.setZero(), com_v_.setZero(), moved_.setZero();
  }
  /// First call of a tick: subtracts the last movement of the pattern from all offsets.
  void follow() {
    for (Eigen::Vector2d& foot : foot_) foot -= moved_;
    com_ -= moved_;
    moved_.setZero();
    // critically damped like the admittance of the CoM
    const double T = settings_->com_leak_s;
    com_v_ += kTick_s * (-2.0 / T * com_v_ - com_ / (T * T));
    com_ += kTick_s * com_v_;
  }
  /// Error of the divergent component at this tick, and how much of it the soles can answer.
  struct Balance {
    Eigen::Vector2d error_W_m, zmp_change_W_m;  ///< e, d
    bool cut = false;                           ///< d is smaller than wished
    double omega_1_s = 0.0;
    std::array<bool, 2> touched{};  ///< swing feet that bear already: they stay there
  };
  /// @return how far the whole pattern has to move after this tick; 0 except at landings
  Eigen::Vector2d step(const PatternSample& plan, const Balance& balance) {
    for (Side side : robot::kSides) {
      if (plan.contact[side]) {
        if (in_air_[side]) moved_ = foot_[side];
        in_air_[side] = false;
        continue;
      }
      in_air_[side] = true;
      const Eigen::Vector2d at_W = plan.foot[side].X_WS.translation().head<2>();
      if (balance.touched[side] && settings_->step_adjustment) {
        foot_[side] += touch_W_[side] - at_W;
        continue;
      }
      touch_W_[side] = at_W;
      const double t = plan.to_landing_s;
      if (t <= kLast_s) continue;
      Eigen::Vector2d goal = Eigen::Vector2d::Zero();
      if (settings_->step_adjustment && balance.cut && t <= kFirst_s) {
        goal = within_reach(plan, landing_error(plan, balance));
      }
      Eigen::Vector2d change = share_ * (goal - foot_[side]);
      const double most = settings_->adjust_speed_m_s * kTick_s;
      if (change.norm() > most) change *= most / change.norm();
      foot_[side] += change;
    }
    return moved_;
  }

  /// Offset of the foot's goal from its plan.
  const Eigen::Vector2d& foot_W_m(Side side) const { return foot_[side]; }
  /// Offset of the wished CoM from the planned one.
  const Eigen::Vector2d& com_W_m() const { return com_; }
  const Eigen::Vector2d& com_v_W() const { return com_v_; }

 private:
  // Window before the landing: earlier the prediction is uncertain, later the foot has no time.
  static constexpr double kFirst_s = 0.55, kLast_s = 0.08;

  /// e_T in the heading frame.
  Eigen::Vector2d landing_error(const PatternSample& plan, const Balance& balance) const {
    const double growth = std::exp(balance.omega_1_s * plan.to_landing_s);
    const Eigen::Rotation2Dd R_WH(plan.yaw_rad);
    const Eigen::Vector2d error = R_WH.inverse() * balance.error_W_m;
    const Eigen::Vector2d change = R_WH.inverse() * balance.zmp_change_W_m;
    // e_T = (e − d) exp(ω t) + d                                                          [eq. 6.7]
    Eigen::Vector2d coming = (error - change) * growth + change;
    const double noise = settings_->adjust_noise_m * growth;
    for (int i = 0; i < 2; ++i) {
      coming[i] -= std::clamp(coming[i], -noise, noise);
      if (coming[i] * error[i] < 0.0) coming[i] = 0.0;
    }
    return coming;
  }
  /// @param wish  in the heading frame. @return in W
  Eigen::Vector2d within_reach(const PatternSample& plan, Eigen::Vector2d wish) const {
    const StabilizerSettings& s = *settings_;
    const double side = robot::sign(plan.swing);
    wish.x() = std::clamp(wish.x(), -s.adjust_forward_m, s.adjust_forward_m);
    wish.y() = side * std::clamp(side * wish.y(), -s.adjust_inward_m, s.adjust_outward_m);
    return Eigen::Rotation2Dd(plan.yaw_rad) * wish;
  }

  const StabilizerSettings* settings_;
  double share_;
  std::array<Eigen::Vector2d, 2> foot_;
  std::array<bool, 2> in_air_{false, false};
  std::array<Eigen::Vector2d, 2> touch_W_;  ///< last place of a foot in the air
  Eigen::Vector2d com_, com_v_, moved_;     ///< moved_: pattern since the last follow()
};

}  // namespace mimesis::walker
