#include "nodes/walker/approach.h"

#include <algorithm>

namespace mimesis::walker {

void Approach::start(const Eigen::VectorXd& from, const Eigen::VectorXd& to,
                     const Eigen::VectorXd& max_speed, double speed_share, double least_s) {
  constexpr double kPeak = 1.875;  // of the rate, in the middle
  from_ = from;
  way_ = to - from;
  q_ = from;
  dq_.setZero(from.size());
  t_s_ = 0.0;
  duration_s_ = least_s;
  for (Eigen::Index j = 0; j < way_.size(); ++j) {
    duration_s_ = std::max(duration_s_, kPeak * std::abs(way_[j]) / (speed_share * max_speed[j]));
  }
}

void Approach::step(double dt_s) {
  t_s_ = std::min(t_s_ + dt_s, duration_s_);
  const double s = duration_s_ > 0.0 ? t_s_ / duration_s_ : 1.0;
  q_ = from_ + (s * s * s * (10.0 + s * (6.0 * s - 15.0))) * way_;
  dq_ = way_ * (30.0 * s * s * (1.0 - s) * (1.0 - s) / std::max(duration_s_, dt_s));
}

}  // namespace mimesis::walker
