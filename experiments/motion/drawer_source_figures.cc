// Sources of the drawer task: their number, quality and shape [M18 3.3].
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/motion/demix/held_out.h"
#include "common/plot/gnuplot.h"
#include "experiments/motion/drawer_training.h"
#include "experiments/motion/figures.h"
#include "experiments/motion/svd.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using plot::Data;
using plot::plot_png;
using namespace reproduce;

// ---- fig. 3.13

mocap::Trials drawn_only(const mocap::Trials& set) {
  mocap::Trials out = set;
  out.trials.resize(10);
  out.samples = set.samples.topRows(10 * set.rows_per_trial());
  return out;
}

constexpr double kLost = 0.01;  // of Q2, by leaving a recording out
constexpr const char* kFittedWeights =
    "in-sample less 0.01: sources and delays are learned from the others, weights and means "
    "fitted; "
    "generated trials vary little";

mocap::Trials together(const std::array<mocap::Trials, kActions>& sets) {
  mocap::Trials all = sets[0];
  for (std::size_t a = 1; a < kActions; ++a) {
    const Index rows = all.samples.rows();
    all.trials.insert(all.trials.end(), sets[a].trials.begin(), sets[a].trials.end());
    all.samples.conservativeResize(rows + sets[a].samples.rows(), Eigen::NoChange);
    all.samples.bottomRows(sets[a].samples.rows()) = sets[a].samples;
  }
  return all;
}

demix::SisaOptions q2_options(const mocap::Trials& set, int periodic, bool tied) {
  demix::SisaOptions options;
  options.sources = 1 + periodic;
  options.tied = tied;
  options.fixed = demix::non_periodic(1, set.samples.cols());
  options.turns = 15;
  options.finalists = 1;
  return options;
}

double sisa_q2(const mocap::Trials& set, int periodic, bool tied) {
  return demix::sisa(set, q2_options(set, periodic, tied)).quality_squared;
}

double held_out_q2(const mocap::Trials& set, int periodic, bool tied) {
  const demix::SisaOptions options = q2_options(set, periodic, tied);
  return demix::sisa_held_out(set, options, demix::sisa(set, options).mixture).quality_squared;
}

// The ramp and the first K principal components of the residual: the same stepwise regression.
std::vector<double> pca_q2(const mocap::Trials& set, int most) {
  const MatrixXd centred = set.samples.colwise() - set.samples.rowwise().mean();
  Eigen::RowVectorXd ramp = demix::non_periodic(1, set.samples.cols());
  ramp.array() -= ramp.mean();
  const MatrixXd rest = centred - (centred * ramp.transpose()) * ramp / ramp.squaredNorm();
  const VectorXd energy = thin_svd(rest).s.cwiseAbs2();
  std::vector<double> q2;
  for (int k = 1; k <= most; ++k)
    q2.push_back(1.0 - energy.tail(energy.size() - k).sum() / centred.squaredNorm());
  return q2;
}

Report approximation(const PlotDir& plot_dir) {
  DrawerData drawn = drawer_data();
  for (auto& set : drawn.action) set = drawn_only(set);
  const mocap::Trials all = together(drawn.action);
  constexpr int kMost = 5;
  Data free{"free", {}}, pca{"pca", {}}, tied{"tied", {}}, stepwise{"stepwise", {}},
      chosen{"chosen", {}};
  const auto components = pca_q2(all, kMost);
  bool better = true;
  for (int k = 1; k <= kMost; ++k) {
    const double q_free = sisa_q2(all, k, false),
                 q_pca = components[static_cast<std::size_t>(k - 1)];
    better = better && q_free > q_pca;
    free.rows.push_back({double(k), q_free});
    pca.rows.push_back({double(k), q_pca});
    tied.rows.push_back({double(k), sisa_q2(drawn.action[kNormalStep], k, true)});
    if (k <= kMost - 2)
      stepwise.rows.push_back({double(k + 2), learn_drawer_model(drawn, {k, 2}).quality_squared});
  }
  Report report;
  report.at_least("Q2 of action 1, 3 periodic sources, tied", tied.rows[2][1],
                  published(0.956, "M18 3.3.3"), "1",
                  "generated trials are simpler than recorded ones");
  report.at_least("the same, each recording left out once",
                  held_out_q2(drawn.action[kNormalStep], 3, true), tied.rows[2][1] - kLost, "1",
                  kFittedWeights);
  report.at_least("Q2 of all actions, 3 + 2 periodic sources, tied", stepwise.rows[2][1],
                  published(0.967, "M18 3.3.3"), "1",
                  "generated trials are simpler than recorded ones");
  report.at_least("the same, each recording left out once",
                  leave_recordings_out(drawn).quality_squared, stepwise.rows[2][1] - kLost, "1",
                  kFittedWeights);
  report.holds("free delays above PCA at every number of sources", better,
               published("M18 fig. 3.13"));
  report.at_least("Q2 of all actions, 3 sources, free delays", free.rows[2][1],
                  published(components[2], "M18 fig. 3.13"), "1", "PCA with 3");
  report.at_least("the same, each recording left out once", held_out_q2(all, 3, false),
                  components[2], "1",
                  "PCA with 3, in-sample; weights, means and delays are fitted");
  report.at_least("Q2 of all 40 trials, 3 + 2 sources", drawer_maps().model().quality_squared,
                  0.967, "1", "what the motions are made from");
  report.at_least("the same, each recording left out once with its other paces",
                  drawer_left_out().quality_squared, drawer_maps().model().quality_squared - kLost,
                  "1", kFittedWeights);
  if (plot_dir) {
    chosen.rows = {{3.0, tied.rows[2][1]}, {5.0, stepwise.rows[2][1]}};
    plot_png(report.picture(*plot_dir / "fig-3.13.png"), 800, 520,
             {free, pca, tied, stepwise, chosen},
             "set xlabel 'periodic sources'; set ylabel 'Q2'; set key bottom right\n"
             "plot $free using 1:2 with linespoints lt 1 pt 7 title 'anechoic, free delays, all "
             "actions', "
             "$pca using 1:2 with linespoints lt 3 pt 7 title 'PCA, all actions', "
             "$tied using 1:2 with linespoints lt 4 dt 3 pt 7 title 'tied delays, action 1', "
             "$stepwise using 1:2 with linespoints lt 2 dt 2 pt 7 title 'tied, two more for "
             "actions 2 and 3', "
             "$chosen using 1:2 with points lt 8 pt 6 ps 2.5 title 'chosen'\n");
  }
  return report;
}

// ---- fig. 3.14

int dominant_harmonic(const Eigen::RowVectorXd& source) {
  const Index n = source.size();
  int best = 1;
  double most = 0.0;
  for (int h = 1; h <= 12; ++h) {
    double re = 0.0, im = 0.0;
    for (Index t = 0; t < n; ++t) {
      const double angle =
          2.0 * std::numbers::pi * h * static_cast<double>(t) / static_cast<double>(n);
      re += source(t) * std::cos(angle);
      im += source(t) * std::sin(angle);
    }
    if (re * re + im * im > most) most = re * re + im * im, best = h;
  }
  return best;
}

Data curves(const std::string& name, const MatrixXd& sources) {
  Data d{name, {}};
  for (Index t = 0; t < sources.cols(); ++t) {
    d.rows.push_back({static_cast<double>(t) / static_cast<double>(sources.cols())});
    for (Index k = 0; k < sources.rows(); ++k) d.rows.back().push_back(sources(k, t));
  }
  return d;
}

std::string panel(const std::string& data, int columns, bool ramp, const std::string& title) {
  std::string script = "set title '" + title + "'\nplot ";
  for (int k = 0; k < columns; ++k)
    script += std::string(k ? ", " : "") + "$" + data + " using 1:" + std::to_string(k + 2) +
              " with lines lt " + (ramp && k == 0 ? "8 dt 2" : std::to_string(ramp ? k : k + 1)) +
              " notitle";
  return script + "\n";
}

Report sources(const PlotDir& plot_dir) {
  Report report;
  const DrawerModel& small = drawer_maps().model();
  const DrawerModel large = learn_drawer_model(drawer_data(), {4, 3});
  const MatrixXd &s = small.action[0].sources, &l = large.action[0].sources;
  report.holds("the non-periodic source falls from 1 to -1",
               s(0, 0) == 1.0 && s(0, s.cols() - 1) < -0.999, published("M18 3.3.3"));
  report.near("harmonic of the strongest periodic source", dominant_harmonic(s.row(1)), goal(1), 0,
              "1");
  double jump = 0.0;
  for (Index k = 1; k < s.rows(); ++k)
    jump = std::max(jump, std::abs(s(k, 0) - s(k, s.cols() - 1)));
  report.at_most("periodic sources close: largest step over the end", jump, 0.5, "1",
                 "rms 1, 100 samples");
  report.at_least("Q2 of all actions with 4 + 3 sources", large.quality_squared,
                  small.quality_squared, "1", "3 + 2 sources");
  if (plot_dir)
    plot_png(report.picture(*plot_dir / "fig-3.14.png"), 1000, 640,
             {curves("a", s.topRows(4)), curves("b", s.bottomRows(2)), curves("c", l.topRows(5)),
              curves("d", l.bottomRows(3))},
             "set multiplot layout 2,2\nset xlabel 't / T'\nset xzeroaxis\n" +
                 panel("a", 4, true, "a) action 1: 3 periodic sources, non-periodic dashed") +
                 panel("b", 2, false, "b) 2 further ones for actions 2 and 3") +
                 panel("c", 5, true, "c) 4 periodic sources") +
                 panel("d", 3, false, "d) 3 further ones") + "unset multiplot\n");
  return report;
}

}  // namespace

void add_drawer_source_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-3.13", "Q2 of the drawer task against the number of sources", "M18",
                  Declared{.published = 4, .goal = 5}, approximation);
  to.emplace_back("fig-3.14", "sources of the drawer task", "M18",
                  Declared{.published = 1, .goal = 3}, sources);
}

}  // namespace mimesis::synthesizer
