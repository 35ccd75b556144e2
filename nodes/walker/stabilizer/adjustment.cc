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

Eigen::Vector2d StepAdjustment::landing_error(const PatternSample& plan,
                                              const Balance& balance) const {
  const double growth = std::exp(balance.omega_1_s * plan.to_landing_s);
  const Eigen::Rotation2Dd R_WH(plan.yaw_rad);
  const Eigen::Vector2d error = R_WH.inverse() * balance.error_W_m;
  const Eigen::Vector2d change = R_WH.inverse() * balance.zmp_change_W_m;
  Eigen::Vector2d coming = (error - change) * growth + change;
  for (int i = 0; i < 2; ++i) {
    if (coming[i] * error[i] < 0.0) coming[i] = 0.0;
  }
  return coming;
}

Eigen::Vector2d StepAdjustment::within_reach(const PatternSample& plan,
                                             Eigen::Vector2d wish) const {
  const StabilizerSettings& s = *settings_;
  const double side = robot::sign(plan.swing);
  wish.x() = std::clamp(wish.x(), -s.adjust_forward_m, s.adjust_forward_m);
  wish.y() = side * std::clamp(side * wish.y(), -s.adjust_inward_m, s.adjust_outward_m);
  return Eigen::Rotation2Dd(plan.yaw_rad) * wish;
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
      goal = within_reach(plan, landing_error(plan, balance));
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
