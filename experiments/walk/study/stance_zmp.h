#pragma once
#include "experiments/walk/trial/trial.h"

namespace mimesis::walk {

/// Lateral variability of the ZMP [M18 3.8.4, fig. 3.46]: standard deviation of true minus planned
/// ZMP, each seen from the standing foot, over all ticks in which one foot stands alone. (The text
/// does not say whether its stance intervals hold double support; there the difference has no one
/// foot to be seen from.)
class StanceZmp {
 public:
  void tick(const walker::WalkerOutput& out, const hw::sim::BodyTruth& truth) {
    const walker::PatternSample& plan = out.pattern;
    if (plan.contact[0] == plan.contact[1]) return;
    const robot::Side s = plan.contact[0] ? robot::kLeft : robot::kRight;
    const double now = truth.zmp_W_m.y() - truth.X_WS[s].translation().y();
    const double wished = plan.zmp_W_m.y() - plan.foot[s].X_WS.translation().y();
    add(now - wished);
  }
  void add(double difference_m) {
    ++count_;
    const double off = difference_m - mean_;
    mean_ += off / static_cast<double>(count_);
    squares_ += off * (difference_m - mean_);
  }
  double std_m() const {
    return count_ > 0 ? std::sqrt(squares_ / static_cast<double>(count_)) : 0.0;
  }

 private:
  long count_ = 0;
  double mean_ = 0.0, squares_ = 0.0;  // of the differences from it [Welford]
};

}  // namespace mimesis::walk
