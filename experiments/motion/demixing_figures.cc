// How many sources movements need, and which ones [M18 3.3.3].
#include <Eigen/Core>
#include <cmath>
#include <map>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "common/motion/demix/held_out.h"
#include "common/motion/mocap/trials.h"
#include "common/plot/gnuplot.h"
#include "common/shared_data.h"
#include "experiments/motion/baselines.h"
#include "experiments/motion/figures.h"
#include "experiments/motion/grafted_raises.h"
#include "experiments/motion/wigner.h"

namespace mimesis::synthesizer {
namespace {

using demix::Mixture;
using Eigen::Index;
using mocap::Trials;
using namespace reproduce;

std::filesystem::path recordings(const std::string& figure, const char* what) {
  const auto path = shared_data("data/mocap") / what;
  if (std::filesystem::exists(path)) return path;
  throw std::runtime_error(figure + ": no recorded motion in " + path.string() +
                           ", set MIMESIS_SHARED to the shared folder");
}

/// Sources over one period, one panel each, as in [M18 fig. 3.11, 3.14]; the first `fixed`, which
/// are not periodic, dashed.
void plot_sources(const std::filesystem::path& png, const Eigen::MatrixXd& sources, int fixed,
                  const std::string& title) {
  const Index count = sources.rows(), samples = sources.cols();
  const double top = 1.1 * sources.cwiseAbs().maxCoeff();
  std::vector<plot::Data> data;
  std::ostringstream script;
  script << "set multiplot layout " << count << ",1 title " << plot::quoted(title)
         << "\nunset key\nset xrange [0:1]\nset yrange [" << -top << ':' << top
         << "]\nset ytics 1\nset xzeroaxis\nset lmargin 8\n";
  for (Index k = 0; k < count; ++k) {
    data.push_back({"s" + std::to_string(k), {}});
    plot::Data& d = data.back();
    for (Index t = 0; t < samples; ++t) {
      d.rows.push_back({static_cast<double>(t) / static_cast<double>(samples), sources(k, t)});
    }
    script << "set ylabel 's" << k + 1 << "'\n"
           << (k + 1 == count ? "set format x '%g'\nset xlabel 'phase / 2π'" : "set format x ''")
           << "\nplot $s" << k << " with lines lw 2 lc " << (k < fixed ? "rgb '#888888' dt 2" : "1")
           << '\n';
  }
  plot::plot_png(png, 640, static_cast<int>(120 + 130 * count), data,
                 script.str() + "unset multiplot\n");
}

/// Approximation quality against the number of sources, as in [M18 fig. 3.10, 3.13].
struct QualityCurve {
  std::string name;
  std::vector<double> sources, quality;  ///< K and Q
  bool dashed = false;
};

void plot_quality(const std::filesystem::path& png, const std::vector<QualityCurve>& curves,
                  const std::string& title) {
  std::vector<plot::Data> data;
  std::ostringstream script;
  script << "set title " << plot::quoted(title) << "\nset xlabel 'number of sources'\n"
         << "set ylabel 'approximation quality Q'\nset key bottom right\nset grid\nset xtics 1\n"
         << "set yrange [:1]\nplot ";
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const QualityCurve& c = curves[i];
    data.push_back({"c" + std::to_string(i), {}});
    plot::Data& d = data.back();
    for (std::size_t k = 0; k < c.sources.size(); ++k) {
      d.rows.push_back({c.sources[k], c.quality[k]});
    }
    script << (i == 0 ? "" : ", ") << "$c" << i << " with linespoints ls " << i + 1 << " lw 2 pt 7 "
           << (c.dashed ? "dt 2 " : "") << "title " << plot::quoted(c.name);
  }
  plot::plot_png(png, 760, 520, data, script.str() + '\n');
}

double q_of(const Trials& set, const Mixture& mixture) {
  return demix::quality(set.samples, mixture.reconstruct());
}

demix::SisaOptions with_ramp(const Trials& set, int sources, bool tied) {
  return {.sources = sources, .tied = tied, .fixed = demix::non_periodic(1, set.samples.cols())};
}

/// Q of SISA with each clip left out once (held_out.h). `whole`: of all clips.
double held_out_q(const Trials& set, const demix::SisaOptions& options, const Mixture& whole) {
  return demix::sisa_held_out(set, options, whole).quality;
}
/// Q of sources on the set that they were learned from, delays searched as for a clip left out.
double searched_alike(const Trials& set, const Mixture& whole) {
  return q_of(set, demix::fit_to(set, whole, demix::Delays::free));
}
double held_out_pca(const Trials& set, int components) {
  return demix::held_out(set, demix::Delays::none, false,
                         [components](const Trials& others) {
                           return demix::principal_components(others, components);
                         })
      .quality;
}
double held_out_wigner(const Trials& set, int sources) {
  return demix::held_out(set, demix::Delays::free, false,
                         [sources](const Trials& others) {
                           return demix::wigner(others, {.sources = sources}).mixture;
                         })
      .quality;
}
constexpr const char* kSearchedAlike =
    "Q of clips left out: their delays are searched from 40 starts, those of the row before from "
    "fewer, so that it may be the lower";
constexpr const char* kNothingLearned =
    "sinusoids with free phases learn nothing: they are the same on any clip; sources are learned "
    "from the other clips, weights, means and delays fitted";

/// Q against K of every method.
class Comparison {
 public:
  Comparison(const Trials& set, int most) : set_(set) {
    for (int k = 1; k <= most; ++k) {
      demix::SisaResult printed = demix::wigner(set, {.sources = k});
      add(marginals, k, printed.quality);
      marginals_mixture.emplace(k, std::move(printed.mixture));
      add_sisa(free, free_mixture, {.sources = k});
      add_sisa(tied, tied_mixture, {.sources = k, .tied = true});
      if (k > 1) {
        add_sisa(ramp, ramp_mixture, with_ramp(set, k, false));
        add(ramp_tied, k, demix::sisa(set, with_ramp(set, k, true)).quality);
      }
    }
    for (int k = 1; k <= kMostComponents; ++k) {
      add(pca, k, q_of(set, demix::principal_components(set, k)));
      add(sinusoids, k, q_of(set, demix::sinusoids(set, k)));
      // FastICA finds other components in the same space, if it finds them
      if (k <= most) add(ica, k, q_of(set, demix::independent_components(set, k)));
    }
  }

  /// Q of the PCA that describes the set by as many numbers as K sources with free delays.
  double pca_of_equal_size(int sources, int& components) const {
    components = demix::components_of_equal_size(
        set_, demix::parameter_count(free_mixture.at(sources), set_, demix::Delays::free));
    return q_of(set_, demix::principal_components(set_, components));
  }

  QualityCurve marginals{"anechoic, Wigner-Ville marginals", {}, {}};
  QualityCurve free{"anechoic, SISA", {}, {}};
  QualityCurve tied{"anechoic, SISA, delays tied", {}, {}, true};
  QualityCurve ramp{"SISA, one is the ramp", {}, {}};
  QualityCurve ramp_tied{"SISA, one is the ramp, tied", {}, {}, true};
  QualityCurve pca{"PCA", {}, {}};
  QualityCurve ica{"FastICA", {}, {}, true};
  QualityCurve sinusoids{"sinusoids, free phases", {}, {}, true};
  /// By number of sources.
  std::map<int, Mixture> marginals_mixture, free_mixture, tied_mixture, ramp_mixture;

 private:
  static constexpr int kMostComponents = 9;
  static void add(QualityCurve& curve, int k, double q) {
    curve.sources.push_back(k);
    curve.quality.push_back(q);
  }
  void add_sisa(QualityCurve& curve, std::map<int, Mixture>& kept,
                const demix::SisaOptions& options) {
    demix::SisaResult result = demix::sisa(set_, options);
    add(curve, options.sources, result.quality);
    kept.emplace(options.sources, std::move(result.mixture));
  }
  const Trials& set_;
};

double at(const QualityCurve& curve, int k) {
  for (std::size_t i = 0; i < curve.sources.size(); ++i) {
    if (curve.sources[i] == k) return curve.quality[i];
  }
  return std::nan("");
}

/// The least K of a curve that reaches Q = 0.92; one more than it has if none does.
double sources_needed(const QualityCurve& curve) {
  for (std::size_t i = 0; i < curve.sources.size(); ++i) {
    if (curve.quality[i] >= 0.92) return curve.sources[i];
  }
  return curve.sources.back() + 1.0;
}

// ---- fig. 3.10 ---------------------------------------------------------------------------------

Report quality_against_sources(const PlotDir& dir) {
  const GraftedSet set = walks_with_raises(recordings("fig-3.10", "bandai_nc"));
  const GraftedSet quick = walks_with_raises(recordings("fig-3.10", "bandai_nc"), 1.0 / 3.0);
  const Comparison c(set.trials, 6);
  const demix::SisaOptions ramp_and_3 = with_ramp(set.trials, 4, false);
  const demix::SisaResult quick_result = demix::sisa(quick.trials, ramp_and_3);
  const double marginals_left_out = held_out_wigner(set.trials, 4),
               quick_left_out = held_out_q(quick.trials, ramp_and_3, quick_result.mixture);
  demix::SisaOptions again = ramp_and_3;
  again.start = quick_result.mixture.sources.bottomRows(3);
  const double quick_again = demix::sisa(quick.trials, again).quality;
  Report report;
  report.rows = {
      at_least("Q of 4 sources, SISA", at(c.free, 4), published(0.92, "M18 3.3.3"), "1",
               "least squares with free delays; walks and grafted arm raises instead of the "
               "dissertation's recordings"),
      at_least("the same, each clip left out once",
               held_out_q(set.trials, {.sources = 4}, c.free_mixture.at(4)), at(c.sinusoids, 4),
               "1", kNothingLearned),
      at_least("Q of 4 sources, Wigner-Ville marginals", at(c.marginals, 4),
               published(0.92, "M18 3.3.3"), "1",
               "the method of the printed curve; no source is bound to the ramp"),
      at_least("the same, each clip left out once", marginals_left_out, at(c.sinusoids, 4), "1",
               kNothingLearned),
      at_least("no clip left out, delays searched as for those",
               searched_alike(set.trials, c.marginals_mixture.at(4)), marginals_left_out, "1",
               kSearchedAlike),
      at_most("sources that SISA needs for Q = 0.92", sources_needed(c.free),
              published(4, "M18 3.3.3"), "1", "of the curve"),
      at_least("components that PCA needs for Q = 0.92", sources_needed(c.pca),
               published(8, "M18 3.3.3"), "1", "PCA and ICA need more than 7"),
      at_most("FastICA off PCA in Q, 4 components", std::abs(at(c.ica, 4) - at(c.pca, 4)), 1e-9,
              "1", "it finds other components of the same space"),
      at_least("Q of the ramp and 3 sources", at(c.ramp, 4), published(0.92, "M18 3.3.3"), "1",
               "the fixed ramp cos(pi t/T) is fitted together with the learned sources"),
      at_least("the same, each clip left out once",
               held_out_q(set.trials, ramp_and_3, c.ramp_mixture.at(4)), at(c.sinusoids, 3), "1",
               "3 sinusoids with free phases, which learn nothing"),
      at_most("what the ramp costs: 4 learned sources less ramp and 3",
              at(c.free, 4) - at(c.ramp, 4), 0.02, "1",
              "a source that cannot be shifted describes less"),
      at_least("Q of the ramp and 3 sources, raises in a third of the period", quick_result.quality,
               0.89, "1", "the quicker the raise, the less the ramp is its shape; printed 0.92"),
      at_least("the same, each clip left out once", quick_left_out,
               q_of(quick.trials, demix::sinusoids(quick.trials, 3)), "1",
               "3 sinusoids with free phases, which learn nothing"),
      at_least(
          "no clip left out, run from the same start as those", quick_again, quick_left_out, "1",
          "Q of clips left out: their runs start from the sources of the row before last, whose "
          "own run had stopped in a local minimum"),
      at_least("Q of 4 tied sources above PCA with 4", at(c.tied, 4) - at(c.pca, 4), 0.0, "1",
               "delays tied across trials, as blending uses them, lose most of the lead"),
      at_least("the same of clips left out",
               held_out_q(set.trials, {.sources = 4, .tied = true}, c.tied_mixture.at(4)) -
                   held_out_pca(set.trials, 4),
               0.0, "1", "the lead of learned delays on other clips: weights and means are fitted"),
      at_least("Q of 4 sources above sinusoids with free phases",
               at(c.free, 4) - at(c.sinusoids, 4), 0.0, "1",
               "much of the quality is the delays themselves")};
  int components = 0;
  const double equal = c.pca_of_equal_size(4, components);
  report.at_least(
      "Q of 4 sources above PCA with " + std::to_string(components) + ", which are as many numbers",
      at(c.free, 4) - equal, 0.0, "1",
      "free delays are parameters too: the lead is real but smaller");
  if (dir) {
    plot_quality(report.picture(*dir / "fig-3.10.png"),
                 {c.marginals, c.free, c.tied, c.ramp, c.ramp_tied, c.pca, c.ica, c.sinusoids},
                 "Fig. 3.10: gaits and grafted arm raises");
  }
  return report;
}

// ---- fig. 3.11 ---------------------------------------------------------------------------------

/// Σ w² of a source over the given rows of the trials from `first` on.
double weight_energy(const Mixture& m, Index rows_per_trial, Index first, Index source,
                     const std::vector<Index>& rows) {
  double sum = 0.0;
  for (Index n = first * rows_per_trial; n < m.weights.rows(); n += rows_per_trial) {
    for (const Index r : rows) sum += m.weights(n + r, source) * m.weights(n + r, source);
  }
  return sum;
}

std::vector<Index> joint_rows(std::initializer_list<int> joints) {
  std::vector<Index> rows;
  for (const int joint : joints) {
    for (Index axis = 0; axis < 3; ++axis) rows.push_back(3 * joint + axis);
  }
  return rows;
}

std::vector<Index> all_rows() {
  std::vector<Index> rows;
  for (Index r = 0; r < mocap::kBodyRows; ++r) rows.push_back(r);
  return rows;
}

Report four_sources(const PlotDir& dir) {
  const GraftedSet set = walks_with_raises(recordings("fig-3.11", "bandai_nc"));
  const demix::SisaResult result = demix::sisa(set.trials, with_ramp(set.trials, 4, false));
  const Mixture& m = result.mixture;
  const Index rows = set.trials.rows_per_trial();
  const auto arms = joint_rows(
      {mocap::kLeftShoulder, mocap::kLeftElbow, mocap::kRightShoulder, mocap::kRightElbow});
  const auto all = all_rows();
  const auto squares = [&](Index source, Index first, const std::vector<Index>& of) {
    return weight_energy(m, rows, first, source, of);
  };
  const auto walks = static_cast<double>(set.walks);
  const double composed = static_cast<double>(set.trials.trials.size()) - walks;
  Report report;
  report.rows = {
      at_least("Q, the ramp and 3 learned sources", result.quality, published(0.92, "M18 3.3.3"),
               "1", "walks and grafted arm raises instead of the dissertation's recordings"),
      at_least("the same, each clip left out once",
               held_out_q(set.trials, with_ramp(set.trials, 4, false), m),
               q_of(set.trials, demix::sinusoids(set.trials, 3)), "1",
               "3 sinusoids with free phases, which learn nothing"),
      at_least("shoulders and elbows in the ramp's weights, composed trials",
               squares(0, set.walks, arms) / squares(0, set.walks, all), 0.9, "1",
               "share of the sum of squares; printed: different from zero only there; 12 of 51 "
               "rows"),
      at_most("shoulders and elbows in the first periodic source's weights, walks",
              (squares(1, 0, arms) - squares(1, set.walks, arms)) /
                  (squares(1, 0, all) - squares(1, set.walks, all)),
              squares(0, set.walks, arms) / squares(0, set.walks, all), "1",
              "the ramp's share; arms swing widely in these styles, but trunk and legs take part"),
      at_least("ramp's squared weights of a composed trial over those of a walk",
               squares(0, set.walks, all) / composed /
                   ((squares(0, 0, all) - squares(0, set.walks, all)) / walks),
               5.0, "1", "it is what the raises need")};
  const Eigen::VectorXd energy = m.weights.colwise().squaredNorm().transpose();
  for (Index k = 0; k < energy.size(); ++k) {
    report.at_least(
        (k == 0 ? std::string("energy of the ramp") : "energy of source " + std::to_string(k)) +
            ", share of all",
        energy[k] / energy.sum(), 0.01, "1", "a source that carries nothing is none");
  }
  if (dir)
    plot_sources(report.picture(*dir / "fig-3.11.png"), m.sources, m.fixed,
                 "Fig. 3.11: sources of gaits and arm raises (dashed: not periodic)");
  return report;
}

// ---- accuracy on the sets A and B --------------------------------------------------------------

Report accuracy(const PlotDir&) {
  struct Goal {
    const char* set;
    double free3, free4, tied4;  ///< measured with a reference implementation
  };
  constexpr double kMoreThanReference = 0.02;  // excess of tied delays
  Report report;
  for (const Goal& goal : {Goal{"A", 0.917, 0.944, 0.834}, Goal{"B", 0.925, 0.953, 0.850}}) {
    const std::string name = goal.set;
    const Trials set =
        mocap::read_trials(recordings("demixing", ("sets/" + name + ".csv").c_str()).string());
    const Comparison c(set, 7);
    int components = 0;
    const double equal = c.pca_of_equal_size(4, components);
    const auto add = [&](Row row) {
      row.what = name + ": " + row.what;
      report.rows.push_back(std::move(row));
    };
    add(at_least("Q, free delays, K = 3", at(c.free, 3), prototype(goal.free3, "motion.md"), "1",
                 "in sample"));
    add(at_least("the same, each clip left out once",
                 held_out_q(set, {.sources = 3}, c.free_mixture.at(3)), at(c.sinusoids, 3), "1",
                 kNothingLearned));
    add(at_least("Q, free delays, K = 4", at(c.free, 4), prototype(goal.free4, "motion.md"), "1",
                 "in sample"));
    add(at_least("the same, each clip left out once",
                 held_out_q(set, {.sources = 4}, c.free_mixture.at(4)), at(c.sinusoids, 4), "1",
                 kNothingLearned));
    add(at_least("Q, tied delays, K = 4", at(c.tied, 4), goal.tied4 + kMoreThanReference, "1",
                 "reference run without a joint gradient step, and 0.02"));
    const double pca = held_out_pca(set, 4);
    add(at_least("the same, each clip left out once",
                 held_out_q(set, {.sources = 4, .tied = true}, c.tied_mixture.at(4)), pca, "1",
                 "PCA, K = 4, held out: sources and delays are learned from the other clips, "
                 "weights and means fitted"));
    add(at_least("Q, Wigner-Ville marginals, K = 4", at(c.marginals, 4),
                 prototype(0.85, "motion.md"), "1", "it does not minimise the error itself"));
    add(at_least("the same, each clip left out once", held_out_wigner(set, 4), pca, "1",
                 "PCA, K = 4, held out"));
    add(at_most("Q, PCA, K = 4", at(c.pca, 4), at(c.tied, 4), "1", "tied delays, K = 4"));
    add(at_most("the same, each clip left out once", pca, at(c.pca, 4), "1", "in-sample"));
    add(at_most("Q, the ramp and 3 sources with free delays", at(c.ramp, 4), at(c.free, 4), "1",
                "4 learned ones: walks need no ramp, it costs quality"));
    add(at_most("Q, sinusoids with free phases, K = 4", at(c.sinusoids, 4), at(c.free, 4), "1",
                "free delays, K = 4"));
    add(at_most("Q, PCA, K = " + std::to_string(components) + ": as many numbers as free, K = 4",
                equal, at(c.free, 4), "1", "free delays, K = 4"));
    add(at_least("components that PCA needs for Q = 0.92", sources_needed(c.pca),
                 published(8, "M18 3.3.3"), "1", "more than 7, on other walks"));
  }
  return report;
}

}  // namespace

void add_demixing_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-3.10", "Q against the number of sources, gaits and grafted arm raises",
                  "M18", Declared{.published = 5, .goal = 13}, quality_against_sources, 4);
  to.emplace_back("fig-3.11", "Four sources, one of them not periodic", "M18",
                  Declared{.published = 1, .goal = 8}, four_sources);
  to.emplace_back("demixing", "Accuracy on the recorded sets A and B", "M18",
                  Declared{.published = 2, .prototype = 6, .goal = 20}, accuracy, 5);
}

}  // namespace mimesis::synthesizer
