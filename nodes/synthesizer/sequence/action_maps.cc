#include "nodes/synthesizer/sequence/action_maps.h"

#include <map>
#include <numbers>
#include <string>
#include <utility>

#include "common/error.h"
#include "common/motion/demix/sisa.h"

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

constexpr double kWide = 4.0, kSmallRidge = 1e-3;  // standard deviations of the inputs; relative

// Legs of the standing body and its pelvis, if `rows` are kDrawerRows.
bool stands(std::size_t row, const std::vector<std::string>& rows) {
  if (std::ssize(rows) != kDrawerRows) return false;
  constexpr std::size_t kFirst = 3 * mocap::kLeftHip, kEnd = 3 * (mocap::kRightAnkle + 1);
  return (row >= kFirst && row < kEnd) || row >= mocap::kBodyRows;
}

bool is_velocity(const std::string& row) {
  return row.ends_with("_m_s") || row.ends_with("_rad_s");
}

// Means and weights of some rows: means, then weights column by column.
Eigen::RowVectorXd flat(const motion::Pattern& p, const std::vector<Eigen::Index>& rows) {
  Eigen::MatrixXd y(std::ssize(rows), 1 + p.weight_rad.cols());
  y << p.mean_rad(rows), p.weight_rad(rows, Eigen::all);
  return y.reshaped().transpose();
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

ActionMaps::ActionMaps(DrawerModel model)
    : model_(std::move(model)), ranges_(learned_ranges(model_)) {
  for (const Action a : {kNormalStep, kReachingStep, kStanding}) {
    const motion::MotionModel& learned = model_.action[a];
    std::vector<Eigen::Index> rows, apart;
    for (std::size_t r = 0; r < learned.rows.size(); ++r) {
      const bool other = a == kStanding ? stands(r, learned.rows) : is_velocity(learned.rows[r]);
      (other ? apart : rows).push_back(static_cast<Eigen::Index>(r));
    }
    // objects stood at few places, so that trials left out are predicted by others of the same
    // place and a narrow kernel wins, which has no data between places: there the kernel has to be
    // wide
    add(a, rows, inputs(a, {}).size(),
        a == kStanding ? LocalRegressionOptions{.bandwidth = kWide, .ridge = kSmallRidge}
                       : LocalRegressionOptions{});
    // a person's manner in `rows` is noise for the task, and asks for a ridge that would flatten
    // velocities
    if (!apart.empty()) add(a, apart, a == kStanding ? 1 : inputs(a, {}).size(), {});
  }
}

void ActionMaps::add(Action action, const std::vector<Eigen::Index>& rows, Eigen::Index inputs_used,
                     const LocalRegressionOptions& options) {
  const auto& patterns = model_.action[action].patterns;
  const auto n = std::ssize(patterns);
  Eigen::MatrixXd x(n, inputs_used), y(n, flat(patterns.front(), rows).size());
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto trial = static_cast<std::size_t>(i);
    x.row(i) = inputs(action, task_of(action, trial)).head(inputs_used);
    y.row(i) = flat(patterns[trial], rows);
  }
  parts_[action].push_back({rows, {x, y, options, clips_of(model_.action[action])}});
}

MotionParameters ActionMaps::at(Action action, const ActionTask& task) const {
  const motion::Pattern& like = model_.action[action].patterns.front();
  const Eigen::VectorXd x = inputs(action, task);
  Eigen::MatrixXd all(like.mean_rad.size(), 1 + like.weight_rad.cols());  // means and weights
  for (const Part& part : parts_[action]) {
    const Eigen::VectorXd y = part.map.at(x.head(part.map.inputs())).value;
    all(part.rows, Eigen::all) = y.reshaped(std::ssize(part.rows), all.cols());
  }
  return {.mean_rad = all.col(0),
          .weight_rad = all.rightCols(like.weight_rad.cols()),
          .delay_rad = like.delay_rad,
          .frequency_rad_s = 2.0 * std::numbers::pi / task.duration_s};
}

}  // namespace mimesis::synthesizer
