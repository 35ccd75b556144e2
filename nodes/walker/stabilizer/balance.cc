#include "nodes/walker/stabilizer/balance.h"

#include "common/robot/dynamics.h"
#include "nodes/walker/stabilizer/leaky.h"

namespace mimesis::walker {

DcmFeedback::DcmFeedback(double com_height_m, const StabilizerSettings& settings)
    : settings_(&settings),
      omega_(std::sqrt(robot::kGravity / com_height_m)),
      velocity_share_(low_pass_share(settings.velocity_filter_s)) {}

void DcmFeedback::reset() {
  first_ = true;
  error_.setZero();
  integral_.setZero();
}

void DcmFeedback::measure(const ComState& planned, const Eigen::Vector2d& com_W_m,
                          const Eigen::Vector2d& com_v_W) {
  planned_v_ = first_ ? planned.v_W
                      : Eigen::Vector2d(planned_v_ + velocity_share_ * (planned.v_W - planned_v_));
  first_ = false;
  error_ = com_W_m - planned.p_W_m + (com_v_W - planned_v_) / omega_;
}

Eigen::Vector2d DcmFeedback::step(bool saturated, double yaw_rad) {
  const StabilizerSettings& s = *settings_;
  for (int i = 0; i < 2; ++i) {
    integral_[i] =
        leaky(integral_[i], saturated ? 0.0 : error_[i], s.integral_leak_s, s.integral_limit);
  }
  const Eigen::Vector2d ahead(std::cos(yaw_rad), std::sin(yaw_rad));
  Eigen::Vector2d beyond = s.kd_1_s / omega_ * error_;
  const double along = ahead.dot(beyond);
  beyond += (std::clamp(along, -s.forward_limit_m, s.forward_limit_m) - along) * ahead;
  return error_ + beyond + s.ki_1_s / omega_ * integral_;
}

const Eigen::Vector2d& ComAdmittance::step(const Eigen::Vector2d& zmp_m,
                                           const Eigen::Vector2d& wished_zmp_m) {
  const StabilizerSettings& s = *settings_;
  const double T = s.com_leak_s;
  rate_ += kTick_s * (s.com_1_s2 * (zmp_m - wished_zmp_m) - 2.0 / T * rate_ - shift_ / (T * T));
  for (int i = 0; i < 2; ++i) {
    const double free = shift_[i] + kTick_s * rate_[i];
    shift_[i] = std::clamp(free, -s.com_limit_m, s.com_limit_m);
    if (shift_[i] != free) rate_[i] = 0.0;  // no wind-up at the limit
  }
  return shift_;
}

}  // namespace mimesis::walker
