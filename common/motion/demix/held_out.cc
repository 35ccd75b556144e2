#include "common/motion/demix/held_out.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/error.h"
#include "common/motion/demix/alternation.h"
#include "common/motion/demix/spectrum.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr int kDelayStarts = 40;  // as many as all turns of sisa() try

/// N×K. The best delays of each trajectory for sources as they are.
MatrixXd best_delays(const mocap::Trials& set, const Mixture& m, bool nonnegative) {
  const Index harmonics = harmonic_count(set.samples.cols()), half = (harmonics + 3) / 4 * 4;
  const MatrixXd sources = to_spectrum(m.sources, harmonics, half).colwise().normalized();
  Alternation fit(to_spectrum(set.samples, harmonics, half),
                  {.groups = set.samples.rows(), .frozen = m.fixed, .nonnegative = nonnegative});
  fit.start(sources, m.delay_rad.transpose());
  fit.search(kDelayStarts);
  fit.refine(20);
  return fit.phi().transpose();
}

}  // namespace

Mixture fit_to(const mocap::Trials& set, const Mixture& learned, Delays delays, bool nonnegative) {
  const Index total = set.samples.rows(), rows = set.rows_per_trial(), k = learned.source_count();
  MIMESIS_ASSERT(learned.sources.cols() == set.samples.cols());
  Mixture m{learned.sources, MatrixXd::Zero(total, k), MatrixXd::Zero(total, k),
            Eigen::VectorXd::Zero(total), learned.fixed};
  if (delays == Delays::tied) {
    for (Index n = 0; n < total; ++n) m.delay_rad.row(n) = learned.delay_rad.row(n % rows);
  }
  if (delays == Delays::free) m.delay_rad = best_delays(set, m, nonnegative);
  fit_weights(set, nonnegative, m);
  return m;
}

mocap::Trials subset(const mocap::Trials& set,
                     const std::function<bool(const mocap::Trial&)>& keep) {
  mocap::Trials out{set.rows, set.task_names, {}, {}};
  std::vector<Index> kept;
  for (std::size_t i = 0; i < set.trials.size(); ++i) {
    if (!keep(set.trials[i])) continue;
    out.trials.push_back(set.trials[i]);
    for (Index r = 0; r < set.rows_per_trial(); ++r) {
      kept.push_back(static_cast<Index>(i) * set.rows_per_trial() + r);
    }
  }
  out.samples = set.samples(kept, Eigen::all);
  return out;
}

HeldOut held_out(const mocap::Trials& set, Delays delays, bool nonnegative,
                 const std::function<Mixture(const mocap::Trials&)>& learn,
                 const std::function<void(double)>& progress) {
  HeldOut out;
  const auto same_clip = [](const mocap::Trial& a, const mocap::Trial& b) {
    return a.clip == b.clip;
  };
  out.by_clip = std::ranges::adjacent_find(set.trials, std::not_fn(same_clip)) != set.trials.end();
  const auto same = [&](const mocap::Trial& a, const mocap::Trial& b) {
    return same_clip(a, b) && (out.by_clip || a.cycle == b.cycle);
  };
  double missing = 0.0, all = 0.0;
  try {
    for (std::size_t i = 0; i < set.trials.size(); ++i) {
      const mocap::Trial& first = set.trials[i];
      const auto is_first = [&](const mocap::Trial& t) { return same(t, first); };
      if (&*std::ranges::find_if(set.trials, is_first) != &first) continue;
      const mocap::Trials asked = subset(set, is_first),
                          others = subset(set, std::not_fn(is_first));
      const MatrixXd fit = fit_to(asked, learn(others), delays, nonnegative).reconstruct();
      const MatrixXd x = asked.samples.colwise() - asked.samples.rowwise().mean();
      missing += (x - (fit.colwise() - fit.rowwise().mean())).squaredNorm();
      all += x.squaredNorm();
      ++out.groups;
      if (progress) {
        progress(static_cast<double>(i + 1) / static_cast<double>(set.trials.size()));
      }
    }
  } catch (const ConfigError& e) {
    return {.by_clip = out.by_clip, .reason = e.what()};
  }
  out.quality = 1.0 - std::sqrt(missing / all);
  out.quality_squared = 1.0 - missing / all;
  return out;
}

HeldOut sisa_held_out(const mocap::Trials& set, SisaOptions options, const Mixture& whole) {
  const Index given = options.fixed.rows() + options.known.sources.rows();
  options.start = whole.sources.bottomRows(options.sources - given);
  const std::function<void(double)> progress = std::move(options.progress);
  options.progress = {};
  return held_out(
      set, options.tied ? Delays::tied : Delays::free, options.nonnegative,
      [&options](const mocap::Trials& others) { return sisa(others, options).mixture; }, progress);
}

}  // namespace mimesis::demix
