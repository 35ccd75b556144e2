#pragma once
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

namespace mimesis::crowd {

inline double mean(std::span<const double> values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

/// Median of rates over random starts: a start with almost nothing of the slowest mode shows the
/// next one until rounding, and would pull a mean up. NaN of nothing.
inline double median(std::vector<double> values) {
  std::ranges::sort(values);
  const std::size_t n = values.size();
  return n == 0 ? std::nan("") : 0.5 * (values[(n - 1) / 2] + values[n / 2]);
}

}  // namespace mimesis::crowd
