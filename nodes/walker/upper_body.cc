#include "nodes/walker/upper_body.h"

#include <algorithm>
#include <cmath>

namespace mimesis::walker {
namespace {

constexpr int kMostAhead = 64;
constexpr double kBraking = 0.9;  ///< used share of the acceleration, because time is discrete

/// Speed with which the distance `left` can be covered with at most the acceleration `most`: linear
/// near the goal, the braking parabola farther away; they meet where the linear law brakes with
/// `most`.
double approach(double left, double gain_1_s, double most) {
  const double far = std::abs(left), linear = most / (gain_1_s * gain_1_s);
  const double v = far < linear ? gain_1_s * far : std::sqrt(most * (2.0 * far - linear));
  return std::copysign(v, left);
}

}  // namespace

UpperBodyFollower::UpperBodyFollower(const robot::Biped& biped, const UpperBodySettings& settings)
    : settings_(settings),
      half_sitting_(biped.half_sitting(biped.upper_body)),
      lower_(biped.tree.lower()(biped.upper_body).array() + settings.margin_rad),
      upper_(biped.tree.upper()(biped.upper_body).array() - settings.margin_rad),
      speed_(settings.speed_share * biped.tree.max_speed()(biped.upper_body)) {
  reset();
  ahead_.assign(kMostAhead, now_);
}

void UpperBodyFollower::reset() {
  wish_ = half_sitting_;
  rate_ = Eigen::VectorXd::Zero(wish_.size());
  now_ = {half_sitting_, rate_, rate_};
  clipped_ = false;
}

bool UpperBodyFollower::wish(const Eigen::VectorXd& q, const Eigen::VectorXd& rate) {
  clipped_ = false;
  if (q.size() == 0) {
    wish_ = half_sitting_;
    rate_.setZero();
    return true;
  }
  const bool good = q.size() == wish_.size() && q.allFinite() &&
                    (rate.size() == 0 || (rate.size() == wish_.size() && rate.allFinite()));
  if (!good) {
    rate_.setZero();
    return false;
  }
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    // a joint whose limits leave no room stands in their middle
    const double low = std::min(lower_[i], 0.5 * (lower_[i] + upper_[i]));
    const double high = std::max(upper_[i], 0.5 * (lower_[i] + upper_[i]));
    wish_[i] = std::clamp(q[i], low, high);
    const bool cut = wish_[i] != q[i];
    const double wished_rate = rate.size() == 0 || cut ? 0.0 : rate[i];
    rate_[i] = std::clamp(wished_rate, -speed_[i], speed_[i]);
    clipped_ = clipped_ || cut || rate_[i] != wished_rate;
  }
  return true;
}

void UpperBodyFollower::step() {
  const double most = settings_.acceleration_rad_s2;
  for (Eigen::Index i = 0; i < wish_.size(); ++i) {
    const double left = wish_[i] - now_.q[i];
    const double catch_up = approach(left, settings_.gain_1_s, kBraking * most);
    const double v = std::clamp(rate_[i] + catch_up, -speed_[i], speed_[i]);
    now_.ddq[i] = std::clamp((v - now_.dq[i]) / kTick_s, -most, most);
    now_.dq[i] += kTick_s * now_.ddq[i];
    now_.q[i] += kTick_s * now_.dq[i];
  }
}

std::span<const UpperBody> UpperBodyFollower::ahead(int samples, double dt_s, double settle_s) {
  const auto n = std::min(std::size_t(std::max(samples, 1)), ahead_.size());
  for (std::size_t k = 0; k < n; ++k) {
    const double t = double(k) * dt_s, keep = std::exp(-t / settle_s);
    UpperBody& a = ahead_[k];
    a.dq = keep * now_.dq;
    a.q = now_.q + settle_s * (1.0 - keep) * now_.dq;
    a.q = a.q.cwiseMax(lower_).cwiseMin(upper_);
    a.ddq = -a.dq / settle_s;
  }
  ahead_[0] = now_;
  return std::span(ahead_).first(n);
}

}  // namespace mimesis::walker
