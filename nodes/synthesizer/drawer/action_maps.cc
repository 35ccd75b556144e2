#include "nodes/synthesizer/drawer/action_maps.h"

#include <map>
#include <numbers>

namespace mimesis::synthesizer {
namespace {

ActionRanges learned_ranges(const DrawerModel& model) {
  std::array<mocap::Trials, kActions> trials;
  for (std::size_t a = 0; a < kActions; ++a)
    for (const Pattern& p : model.action[a].patterns) trials[a].trials.push_back(p.trial);
  return ranges_of(trials);
}

// Means, then weights column by column.
Eigen::RowVectorXd flat(const Pattern& p) {
  Eigen::RowVectorXd y(p.mean_rad.size() + p.weight_rad.size());
  y << p.mean_rad.transpose(), p.weight_rad.reshaped().transpose();
  return y;
}

Eigen::VectorXi clips_of(const MotionModel& model) {
  std::map<std::string, int> number;
  Eigen::VectorXi group(static_cast<Eigen::Index>(model.patterns.size()));
  for (Eigen::Index i = 0; i < group.size(); ++i)
    group(i) = number
                   .emplace(model.patterns[static_cast<std::size_t>(i)].trial.clip,
                            static_cast<int>(number.size()))
                   .first->second;
  return group;
}

}  // namespace

Eigen::VectorXd ActionMaps::inputs(Action action, const ActionTask& t) {
  switch (action) {
    case kNormalStep:
      return Eigen::Vector2d(t.length_m, t.duration_s);
    case kReachingStep:
      return Eigen::Vector3d(t.length_m, t.duration_s, t.previous_length_m);
    case kStanding:
      break;
  }
  return Eigen::Vector4d(t.previous_length_m, t.final_distance_m, t.object_depth_m,
                         t.object_lateral_m);
}

ActionTask ActionMaps::task_of(Action action, std::size_t i) const {
  const mocap::Trial& trial = model_.action[action].patterns.at(i).trial;
  const double previous =
      action == kNormalStep
          ? 0.0
          : model_.action[static_cast<std::size_t>(action - 1)].patterns.at(i).trial.step_length_m;
  return {.length_m = trial.step_length_m,
          .duration_s = trial.duration_s,
          .previous_length_m = previous,
          .final_distance_m = trial.task.at(1),
          .object_depth_m = trial.task.at(2),
          .object_lateral_m = trial.task.at(3)};
}

ActionMaps::ActionMaps(DrawerModel model, const LocalRegressionOptions& options)
    : model_(std::move(model)), ranges_(learned_ranges(model_)) {
  for (const Action a : {kNormalStep, kReachingStep, kStanding}) {
    const auto& patterns = model_.action[a].patterns;
    const auto n = static_cast<Eigen::Index>(patterns.size());
    Eigen::MatrixXd x(n, inputs(a, {}).size()), y(n, flat(patterns.front()).size());
    for (Eigen::Index i = 0; i < n; ++i) {
      x.row(i) = inputs(a, task_of(a, static_cast<std::size_t>(i)));
      y.row(i) = flat(patterns[static_cast<std::size_t>(i)]);
    }
    maps_.emplace_back(x, y, options, clips_of(model_.action[a]));
  }
}

MotionParameters ActionMaps::at(Action action, const ActionTask& task) const {
  const Pattern& like = model_.action[action].patterns.front();
  const Eigen::VectorXd y = maps_[action].at(inputs(action, task)).value;
  const auto rows = like.mean_rad.size();
  return {.mean_rad = y.head(rows),
          .weight_rad = y.tail(y.size() - rows).reshaped(rows, like.weight_rad.cols()),
          .delay_rad = like.delay_rad,
          .frequency_rad_s = 2.0 * std::numbers::pi / task.duration_s};
}

}  // namespace mimesis::synthesizer
