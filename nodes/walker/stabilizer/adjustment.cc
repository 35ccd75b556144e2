#include "nodes/walker/stabilizer/adjustment.h"

#include "nodes/walker/stabilizer/leaky.h"

namespace mimesis::walker {
namespace {

// Seconds before the landing: sooner the prediction is worth little, later the foot has no time.
constexpr double kFirst_s = 0.55, kLast_s = 0.08;

}  // namespace

StepAdjustment::StepAdjustment(const StabilizerSettings& settings)
    : settings_(&settings), share_(low_pass_share(settings.adjust_filter_s)) {
  reset();
}

void StepAdjustment::reset() {
  foot_.fill(Eigen::Vector2d::Zero());
  in_air_.fill(false);
  com_.setZero(), com_v_.setZero(), moved_.setZero();
}

void StepAdjustment::follow() {
  for (Eigen::Vector2d& foot : foot_) foot -= moved_;
  com_ -= moved_;
  moved_.setZero();
  // critically damped, as the admittance of the CoM
  const double T = settings_->com_leak_s;
  com_v_ += kTick_s * (-2.0 / T * com_v_ - com_ / (T * T));
  com_ += kTick_s * com_v_;
}

Eigen::Vector2d StepAdjustment::within_reach(const PatternSample& plan,
                                             const Eigen::Vector2d& wish_W) const {
  const StabilizerSettings& s = *settings_;
  const Eigen::Rotation2Dd R_WH(plan.yaw_rad);
  Eigen::Vector2d wish = R_WH.inverse() * wish_W;
  const double side = robot::sign(plan.swing);
  wish.x() = std::clamp(wish.x(), -s.adjust_forward_m, s.adjust_forward_m);
  wish.y() = side * std::clamp(side * wish.y(), -s.adjust_inward_m, s.adjust_outward_m);
  return R_WH * wish;
}

Eigen::Vector2d StepAdjustment::step(const PatternSample& plan, const Balance& balance) {
  for (Side side : robot::kSides) {
    if (plan.contact[side]) {
      if (in_air_[side]) moved_ = foot_[side];
      in_air_[side] = false;
      continue;
    }
    in_air_[side] = true;
    const double t = plan.to_landing_s;
    if (t <= kLast_s) continue;
    Eigen::Vector2d goal = Eigen::Vector2d::Zero();
    if (settings_->step_adjustment && balance.cut && t <= kFirst_s) {
      const Eigen::Vector2d& d = balance.zmp_change_W_m;
      goal = within_reach(plan, (balance.error_W_m - d) * std::exp(balance.omega_1_s * t) + d);
      if (goal.norm() < settings_->adjust_least_m) goal.setZero();
    }
    Eigen::Vector2d change = share_ * (goal - foot_[side]);
    const double most = settings_->adjust_speed_m_s * kTick_s;
    if (change.norm() > most) change *= most / change.norm();
    foot_[side] += change;
  }
  return moved_;
}

}  // namespace mimesis::walker
