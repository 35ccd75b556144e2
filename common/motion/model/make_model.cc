#include "common/motion/model/make_model.h"

#include "common/error.h"

namespace mimesis::synthesizer {
namespace {

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

}  // namespace mimesis::synthesizer
