#include "nodes/synthesizer/drawer/drawer_model.h"

#include <cmath>
#include <numbers>
#include <string>

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
  options.fixed = drawer_ramp(set.samples.cols());
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
MotionModel as_model(const DrawerData& data, Action action, const demix::Mixture& mix,
                     const demix::Mixture& all) {
  const auto& set = data.action[action];
  const Eigen::MatrixXd fit = mix.reconstruct();
  const auto rows = set.rows_per_trial(), k = mix.source_count(), k_all = all.source_count();
  MotionModel model{.name = set.trials.front().style,
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
    Pattern p{.trial = set.trials[i],
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

}  // namespace

Eigen::MatrixXd drawer_ramp(Eigen::Index samples) {
  Eigen::MatrixXd ramp(1, samples);
  for (Eigen::Index t = 0; t < samples; ++t)
    ramp(0, t) = std::cos(std::numbers::pi * static_cast<double>(t) / static_cast<double>(samples));
  return ramp;
}

DrawerModel learn_drawer_model(const DrawerData& data, const DrawerModelOptions& options) {
  if (options.first_sources < 1 || options.further_sources < 1)
    throw ConfigError("drawer model: " + std::to_string(options.first_sources) + " + " +
                      std::to_string(options.further_sources) +
                      " sources, expected at least 1 of each kind");
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

}  // namespace mimesis::synthesizer
