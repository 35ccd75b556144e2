#include "nodes/walker/approach.h"

#include <algorithm>
#include <cmath>

#include "common/math/minimum_jerk.h"

namespace mimesis::walker {

void Approach::start(const Eigen::VectorXd& from, const Eigen::VectorXd& to,
                     const Eigen::VectorXd& max_speed, double speed_share, double least_s) {
  from_ = from;
  way_ = to - from;
  q_ = from;
  dq_.setZero(from.size());
  t_s_ = 0.0;
  duration_s_ = least_s;
  for (Eigen::Index j = 0; j < way_.size(); ++j) {
    const double least = math::kMinimumJerkPeak * std::abs(way_[j]) / (speed_share * max_speed[j]);
    duration_s_ = std::max(duration_s_, least);
  }
}

void Approach::step(double dt_s) {
  t_s_ = std::min(t_s_ + dt_s, duration_s_);
  const double s = duration_s_ > 0.0 ? t_s_ / duration_s_ : 1.0;
  q_ = from_ + math::minimum_jerk(s) * way_;
  dq_ = way_ * (math::minimum_jerk_rate(s) / std::max(duration_s_, dt_s));
}

}  // namespace mimesis::walker
