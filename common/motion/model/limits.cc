#include "common/motion/model/limits.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/error.h"
#include "common/motion/demix/mixture.h"

namespace mimesis::synthesizer {
namespace {

/// The nearest T that is not beyond a limit: rounding a limit to float may pass it.
template <typename T>
T within(double limit, double other) {
  const T rounded = static_cast<T>(limit);
  const bool beyond =
      limit < other ? static_cast<double>(rounded) < limit : static_cast<double>(rounded) > limit;
  return beyond ? std::nextafter(rounded, static_cast<T>(other)) : rounded;
}

template <typename T>
int clamp_values(const MotionModel& model, std::span<T> values) {
  MIMESIS_ASSERT(values.size() == model.rows.size());
  int moved = 0;
  for (std::size_t r = 0; r < model.limits_rad.size(); ++r) {
    const auto& limits = model.limits_rad[r];
    if (!limits) continue;
    const auto value = static_cast<double>(values[r]);
    if (value >= limits->lower && value <= limits->upper) continue;
    values[r] = value > limits->upper ? within<T>(limits->upper, limits->lower)
                                      : within<T>(limits->lower, limits->upper);
    ++moved;
  }
  return moved;
}

}  // namespace

int clamp_to_limits(const MotionModel& model, std::span<float> values) {
  return clamp_values(model, values);
}
int clamp_to_limits(const MotionModel& model, std::span<double> values) {
  return clamp_values(model, values);
}

std::vector<LimitExcess> limit_excess(const MotionModel& model) {
  std::vector<LimitExcess> out;
  for (std::size_t r = 0; r < model.limits_rad.size(); ++r) {
    if (!model.limits_rad[r]) continue;
    out.push_back({model.rows[r], -std::numeric_limits<double>::infinity()});
  }
  for (std::size_t p = 0; p < model.patterns.size(); ++p) {
    const Pattern& q = model.patterns[p];
    const Eigen::MatrixXd values =
        demix::Mixture{model.sources, q.weight_rad, q.delay_rad, q.mean_rad, model.fixed}
            .reconstruct();
    std::size_t next = 0;
    for (std::size_t r = 0; r < model.limits_rad.size(); ++r) {
      const auto& limits = model.limits_rad[r];
      if (!limits) continue;
      LimitExcess& worst = out[next++];
      for (Eigen::Index t = 0; t < values.cols(); ++t) {
        const double x = values(static_cast<Eigen::Index>(r), t);
        const double beyond = std::max(x - limits->upper, limits->lower - x);
        if (beyond <= worst.beyond_rad) continue;
        worst.beyond_rad = beyond;
        worst.pattern = p;
        worst.phase_rad =
            2.0 * std::numbers::pi * static_cast<double>(t) / static_cast<double>(values.cols());
      }
    }
  }
  return out;
}

}  // namespace mimesis::synthesizer
