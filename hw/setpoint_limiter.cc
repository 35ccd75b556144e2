#include "hw/setpoint_limiter.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"

namespace mimesis::hw {
namespace {

/// Fastest velocity from which braking at `a` still ends within `distance`, in steps of `dt`.
double braking_velocity(double distance, double a, double dt) {
  const double half = 0.5 * a * dt;
  return std::sqrt(half * half + 2.0 * a * std::max(distance, 0.0)) - half;
}

}  // namespace

SetpointLimiter::SetpointLimiter(JointLimits limits, double dt_s)
    : limits_(std::move(limits)),
      dt_(dt_s),
      q_(limits_.q_min),
      v_(limits_.q_min),
      target_(limits_.q_min) {
  const Eigen::Index n = limits_.q_min.size();
  MIMESIS_ASSERT(limits_.q_max.size() == n && limits_.v_max.size() == n &&
                 limits_.a_max.size() == n);
  MIMESIS_ASSERT(dt_ > 0.0 && (limits_.v_max.array() > 0.0).all() &&
                 (limits_.a_max.array() > 0.0).all());
  v_.setZero();
}

void SetpointLimiter::reset(std::span<const double> q) {
  const Eigen::Map<const Eigen::VectorXd> start(q.data(), static_cast<Eigen::Index>(q.size()));
  q_ = start;
  target_ = start.cwiseMax(limits_.q_min).cwiseMin(limits_.q_max);
  v_.setZero();
}

void SetpointLimiter::advance(Eigen::Index i, double wanted) {
  const double a = limits_.a_max[i], v_max = limits_.v_max[i];
  double v = std::clamp(wanted, -v_max, v_max);
  v = std::clamp(v, v_[i] - a * dt_, v_[i] + a * dt_);
  v = std::clamp(v, -braking_velocity(q_[i] - limits_.q_min[i], a, dt_),
                 braking_velocity(limits_.q_max[i] - q_[i], a, dt_));
  v_[i] = v;
  q_[i] = std::clamp(q_[i] + v * dt_, std::min(q_[i], limits_.q_min[i]),
                     std::max(q_[i], limits_.q_max[i]));
}

bool SetpointLimiter::follow(std::span<const double> target) {
  MIMESIS_ASSERT(static_cast<Eigen::Index>(target.size()) == q_.size());
  bool limited = false;
  for (Eigen::Index i = 0; i < q_.size(); ++i) {
    const double asked = target[static_cast<std::size_t>(i)];
    const double end = std::clamp(asked, limits_.q_min[i], limits_.q_max[i]);
    const double stream = std::clamp((end - target_[i]) / dt_, -limits_.v_max[i], limits_.v_max[i]);
    const double lag = end - (q_[i] + stream * dt_);
    const double approach =
        std::min(std::abs(lag) / dt_, braking_velocity(std::abs(lag), limits_.a_max[i], dt_));
    advance(i, stream + std::copysign(approach, lag));
    target_[i] = end;
    limited = limited || std::abs(q_[i] - asked) > 1e-9;  // below an encoder's increment
  }
  return limited;
}

void SetpointLimiter::rest() noexcept {
  v_.setZero();
  target_ = q_;
}

void SetpointLimiter::coast(int cycles) {
  for (Eigen::Index i = 0; i < q_.size(); ++i) {
    const double way = cycles * dt_ * v_[i];
    q_[i] += way;
    target_[i] += way;
  }
}

void SetpointLimiter::hold() {
  for (Eigen::Index i = 0; i < q_.size(); ++i) advance(i, 0.0);
  target_ = q_;
}

}  // namespace mimesis::hw
