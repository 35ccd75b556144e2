#include "nodes/synthesizer/sequence/action_maps.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/motion/demix/sisa.h"
#include "nodes/synthesizer/sequence/action_course.h"

namespace mimesis::synthesizer {

namespace {

demix::SisaResult demixed(const mocap::Trials& set, int sources, const demix::KnownSources& known,
                          const DrawerModelOptions& wished) {
  demix::SisaOptions options;
  options.turns = wished.turns;
  options.tolerance = wished.tolerance;
  options.seed = wished.seed;
  options.tied = true;
  options.fixed = demix::non_periodic(1, set.samples.cols());
  options.known = known;
  options.sources = sources;
  return demix::sisa(set, options);
}

mocap::Trials joined(mocap::Trials a, const mocap::Trials& b) {
  const auto rows = a.samples.rows();
  a.trials.insert(a.trials.end(), b.trials.begin(), b.trials.end());
  a.samples.conservativeResize(rows + b.samples.rows(), Eigen::NoChange);
  a.samples.bottomRows(b.samples.rows()) = b.samples;
  return a;
}

demix::Mixture part_of(demix::Mixture all, Eigen::Index first, Eigen::Index count) {
  all.weights = all.weights.middleRows(first, count).eval();
  all.delay_rad = all.delay_rad.middleRows(first, count).eval();
  all.means = all.means.segment(first, count).eval();
  return all;
}

// The mixture of one action in terms of all sources; those it was not learned with get weight 0.
motion::MotionModel as_model(const DrawerData& data, Action action, const demix::Mixture& mix,
                             const demix::Mixture& all) {
  const auto& set = data.action[action];
  const Eigen::MatrixXd fit = mix.reconstruct();
  const auto rows = set.rows_per_trial(), k = mix.source_count(), k_all = all.source_count();
  motion::MotionModel model{.name = set.trials.front().style,
                            .created_by = "mimesis drawer",
                            .learned_from = {},
                            .body = data.body,
                            .rows = set.rows,
                            .task_names = set.task_names,
                            .sources = all.sources,
                            .fixed = 1,
                            .tied = true,
                            .patterns = {},
                            .quality = demix::quality(set.samples, fit),
                            .quality_squared = demix::quality_squared(set.samples, fit)};
  for (std::size_t i = 0; i < set.trials.size(); ++i) {
    const auto first = static_cast<Eigen::Index>(i) * rows;
    motion::Pattern p{.trial = set.trials[i],
                      .mean_rad = mix.means.segment(first, rows),
                      .weight_rad = Eigen::MatrixXd::Zero(rows, k_all),
                      .delay_rad = all.delay_rad.topRows(rows)};
    p.weight_rad.leftCols(k) = mix.weights.middleRows(first, rows);
    model.patterns.push_back(std::move(p));
  }
  return model;
}

double explained(const std::array<mocap::Trials, kActions>& sets,
                 const std::array<const demix::Mixture*, kActions>& mixtures) {
  double missing = 0.0, all = 0.0;
  for (std::size_t a = 0; a < kActions; ++a) {
    const Eigen::MatrixXd& x = sets[a].samples;
    missing += (x - mixtures[a]->reconstruct()).squaredNorm();
    all += (x.colwise() - x.rowwise().mean()).squaredNorm();
  }
  return 1.0 - missing / all;
}

ActionRanges learned_ranges(const DrawerModel& model) {
  std::array<mocap::Trials, kActions> trials;
  for (std::size_t a = 0; a < kActions; ++a)
    for (const motion::Pattern& p : model.action[a].patterns) trials[a].trials.push_back(p.trial);
  return ranges_of(trials);
}

constexpr int kLegRows = 3 * (mocap::kRightAnkle - mocap::kLeftHip + 1);
constexpr double kWide = 4.0, kSmallRidge = 1e-3;  // standard deviations of the inputs; relative

// Means, then weights column by column.
Eigen::RowVectorXd flat(const motion::Pattern& p) {
  Eigen::RowVectorXd y(p.mean_rad.size() + p.weight_rad.size());
  y << p.mean_rad.transpose(), p.weight_rad.reshaped().transpose();
  return y;
}

Eigen::VectorXi clips_of(const motion::MotionModel& model) {
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

DrawerModel learn_drawer_model(const DrawerData& data, const DrawerModelOptions& options) {
  MIMESIS_ASSERT(options.first_sources >= 1 && options.further_sources >= 0);
  const auto rows = data.action[0].rows_per_trial();
  const int first = 1 + options.first_sources, all = first + options.further_sources;
  const auto one = demixed(data.action[kNormalStep], first, {}, options);
  const auto later = demixed(joined(data.action[kReachingStep], data.action[kStanding]), all,
                             demix::known_sources(one.mixture, rows), options);
  const auto two = part_of(later.mixture, 0, data.action[kReachingStep].samples.rows());
  const auto three = part_of(later.mixture, data.action[kReachingStep].samples.rows(),
                             data.action[kStanding].samples.rows());
  return {
      .body = data.body,
      .drawer = data.drawer,
      .options = options,
      .action = {as_model(data, kNormalStep, one.mixture, two),
                 as_model(data, kReachingStep, two, two), as_model(data, kStanding, three, two)},
      .quality_squared = explained(data.action, {&one.mixture, &two, &three}),
      .first_quality_squared = one.quality_squared};
}

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
    // objects stood at few places, so that trials left out are predicted by others of the same
    // place and a narrow kernel wins, which has no data between places: there the kernel has to be
    // wide
    LocalRegressionOptions chosen = options;
    if (a == kStanding && options.bandwidth == 0.0) chosen.bandwidth = kWide;
    if (a == kStanding && options.ridge == 0.0) chosen.ridge = kSmallRidge;
    if (a == kStanding && patterns.front().mean_rad.size() == kDrawerRows)
      standing_legs_.emplace_back(x.leftCols(1), y, options, clips_of(model_.action[a]));
    maps_.emplace_back(x, y, chosen, clips_of(model_.action[a]));
  }
}

MotionParameters ActionMaps::at(Action action, const ActionTask& task) const {
  const motion::Pattern& like = model_.action[action].patterns.front();
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

LearnedActions::LearnedActions(const DrawerData& data, const DrawerModelOptions& options)
    : maps_(learn_drawer_model(data, options)) {}

void LearnedActions::at(const MotionParameters& p, double phase_rad,
                        Eigen::Ref<Eigen::VectorXd> out) const {
  mixture_at(maps_.model().action[0], p, phase_rad, Between::cubic, out);
}

Eigen::MatrixXd LearnedActions::played(const MotionParameters& parameters) const {
  const Eigen::Index samples = maps_.model().action[0].sources.cols();
  Eigen::MatrixXd rows(row_count(), samples);
  for (Eigen::Index t = 0; t < samples; ++t) {
    at(parameters, math::kTwoPi * static_cast<double>(t) / static_cast<double>(samples),
       rows.col(t));
  }
  return rows;
}

Eigen::MatrixXd LearnedActions::reconstruct(Action action, std::size_t trial) const {
  return played(parameters_of(maps_.model().action[action].patterns.at(trial)));
}

Eigen::MatrixXd LearnedActions::infer(Action action, const ActionTask& task) const {
  return played(maps_.at(action, task));
}

double travel_m(const std::vector<std::string>& names, const Eigen::MatrixXd& rows,
                double duration_s) {
  const auto found = std::ranges::find(names, "pelvis.forward_m_s");
  if (found == names.end()) throw ConfigError("no row 'pelvis.forward_m_s'");
  return duration_s * rows.row(found - names.begin()).mean();
}

}  // namespace mimesis::synthesizer
