#pragma once
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

namespace mimesis::crowd {

/// Straight line through log R over time, fed one point after the other, of those with R inside a
/// window: above it the decay is not yet exponential, below it only rounding is left.
class DecayFit {
 public:
  DecayFit(double least, double most) : least_(least), most_(most) {}

  void add(double time_s, double r) {
    if (!(r > least_ && r < most_)) return;
    const double y = std::log(r);
    n_ += 1.0;
    const double dt = time_s - mean_t_, dy = y - mean_y_;
    mean_t_ += dt / n_;
    mean_y_ += dy / n_;
    tt_ += dt * (time_s - mean_t_);
    ty_ += dt * (y - mean_y_);
  }
  bool known() const { return n_ >= 10.0; }
  double rate_1_s() const { return -ty_ / tt_; }  ///< + for decay
  /// When the line crosses R = 1: the end of the offset time [M18 4.3.6].
  double offset_s() const { return mean_t_ + mean_y_ / rate_1_s(); }

 private:
  double least_, most_;
  double n_ = 0.0, mean_t_ = 0.0, mean_y_ = 0.0, tt_ = 0.0, ty_ = 0.0;
};

inline double mean(std::span<const double> values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

/// Of rates over random starts: a start with almost nothing of the slowest mode shows the next one
/// until rounding, and would pull a mean up.
inline double median(std::vector<double> values) {
  std::ranges::sort(values);
  const std::size_t n = values.size();
  return n == 0 ? std::nan("") : 0.5 * (values[(n - 1) / 2] + values[n / 2]);
}

}  // namespace mimesis::crowd
