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

constexpr int kLegRows = 3 * (mocap::kRightAnkle - mocap::kLeftHip + 1);
constexpr double kWide = 4.0, kSmallRidge = 1e-3;  // standard deviations of the inputs; relative

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
    // objects stood at few places, so that trials left out are told by others of the same place and
    // a narrow kernel wins, which knows nothing of places between: there the kernel has to be wide
    LocalRegressionOptions chosen = options;
    if (a == kStanding && options.bandwidth == 0.0) chosen.bandwidth = kWide;
    if (a == kStanding && options.ridge == 0.0) chosen.ridge = kSmallRidge;
    if (a == kStanding && patterns.front().mean_rad.size() == kDrawerRows)
      standing_legs_.emplace_back(x.leftCols(1), y, options, clips_of(model_.action[a]));
    maps_.emplace_back(x, y, chosen, clips_of(model_.action[a]));
  }
}

MotionParameters ActionMaps::at(Action action, const ActionTask& task) const {
  const Pattern& like = model_.action[action].patterns.front();
  const Eigen::VectorXd y = maps_[action].at(inputs(action, task)).value;
  const auto rows = like.mean_rad.size();
  Eigen::MatrixXd all = y.reshaped(rows, 1 + like.weight_rad.cols());  // means and weights
  if (action == kStanding && !standing_legs_.empty()) {
    const Eigen::VectorXd length = Eigen::VectorXd::Constant(1, task.previous_length_m);
    const Eigen::MatrixXd legs = standing_legs_.front().at(length).value.reshaped(rows, all.cols());
    all.middleRows(3 * mocap::kLeftHip, kLegRows) = legs.middleRows(3 * mocap::kLeftHip, kLegRows);
    all.bottomRows(kPelvisRows) = legs.bottomRows(kPelvisRows);
  }
  return {.mean_rad = all.col(0),
          .weight_rad = all.rightCols(like.weight_rad.cols()),
          .delay_rad = like.delay_rad,
          .frequency_rad_s = 2.0 * std::numbers::pi / task.duration_s};
}

}  // namespace mimesis::synthesizer
