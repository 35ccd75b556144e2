#include "common/motion/model/motion_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/error.h"

namespace mimesis::motion {
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

void add(const Pattern& p, Pattern& sum) {
  sum.mean_rad += p.mean_rad;
  sum.weight_rad += p.weight_rad;
  sum.trial.duration_s += p.trial.duration_s;
  sum.trial.step_length_m += p.trial.step_length_m;
  sum.trial.turn_rad += p.trial.turn_rad;
  for (std::size_t i = 0; i < p.trial.task.size(); ++i) sum.trial.task[i] += p.trial.task[i];
}

void scale(double by, Pattern& p) {
  p.mean_rad *= by;
  p.weight_rad *= by;
  p.trial.duration_s *= by;
  p.trial.step_length_m *= by;
  p.trial.turn_rad *= by;
  for (double& value : p.trial.task) value *= by;
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

MotionModel make_model(const mocap::Trials& set, const demix::Mixture& mixture, bool tied,
                       const mocap::Body& body) {
  const Eigen::Index rows = set.rows_per_trial(), count = set.samples.rows();
  if (mixture.weights.rows() != count || mixture.sources.cols() != set.samples.cols() ||
      rows * static_cast<Eigen::Index>(set.trials.size()) != count) {
    throw ConfigError("motion model: the mixture has " + std::to_string(mixture.weights.rows()) +
                      " rows, expected the " + std::to_string(count) + " of the set");
  }
  const Eigen::MatrixXd fit = mixture.reconstruct();
  MotionModel model;
  model.body = body;
  model.rows = set.rows;
  model.task_names = set.task_names;
  model.sources = mixture.sources;
  model.fixed = mixture.fixed;
  model.tied = tied;
  model.quality = demix::quality(set.samples, fit);
  model.quality_squared = demix::quality_squared(set.samples, fit);
  for (std::size_t i = 0; i < set.trials.size(); ++i) {
    const Eigen::Index first = static_cast<Eigen::Index>(i) * rows;
    model.patterns.push_back({.trial = set.trials[i],
                              .mean_rad = mixture.means.segment(first, rows),
                              .weight_rad = mixture.weights.middleRows(first, rows),
                              .delay_rad = mixture.delay_rad.middleRows(first, rows)});
  }
  return model;
}

MotionModel average_styles(const MotionModel& model) {
  if (!model.tied) throw ConfigError("average of patterns: the model's delays are not tied");
  MotionModel out = model;
  out.patterns.clear();
  std::vector<double> counts;
  for (const Pattern& p : model.patterns) {
    std::size_t i = 0;
    while (i < out.patterns.size() && out.patterns[i].trial.style != p.trial.style) ++i;
    if (i == out.patterns.size()) {
      out.patterns.push_back(p);
      counts.push_back(1.0);
    } else {
      add(p, out.patterns[i]);
      counts[i] += 1.0;
    }
  }
  for (std::size_t i = 0; i < counts.size(); ++i) scale(1.0 / counts[i], out.patterns[i]);
  return out;
}

}  // namespace mimesis::motion
