#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <span>
#include <vector>

namespace mimesis::reproduce {

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

/// Slope of the line through points (x, y) by least squares.
template <class Points>
double slope(const Points& points) {
  double mx = 0.0, my = 0.0, xx = 0.0, xy = 0.0;
  for (const auto& p : points) {
    mx += p[0] / static_cast<double>(points.size());
    my += p[1] / static_cast<double>(points.size());
  }
  for (const auto& p : points) {
    xx += (p[0] - mx) * (p[0] - mx);
    xy += (p[0] - mx) * (p[1] - my);
  }
  return xy / xx;
}

/// Normal deviate by Box and Muller: std::normal_distribution differs between libraries.
inline double normal(std::mt19937& random) {
  const auto uniform = [&] { return (static_cast<double>(random()) + 0.5) / 4294967296.0; };
  const double radius = std::sqrt(-2.0 * std::log(uniform()));
  return radius * std::cos(2.0 * std::numbers::pi * uniform());
}

}  // namespace mimesis::reproduce
