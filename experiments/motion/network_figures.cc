// Two architectures come into step with a leader [M18 fig. 3.31].
#include <algorithm>
#include <numbers>
#include <sstream>

#include "common/motion/demix/held_out.h"
#include "common/motion/demix/sisa.h"
#include "common/motion/model/motion_model.h"
#include "common/plot/gnuplot.h"
#include "experiments/motion/avatar_network.h"
#include "experiments/motion/baselines.h"
#include "experiments/motion/figures.h"
#include "experiments/motion/styled_walks.h"

namespace mimesis::synthesizer {
namespace {

using plot::Data;
using namespace reproduce;

constexpr double kQuarter = 0.5 * std::numbers::pi;  // offset at the start, ahead and behind
constexpr double kExternal = 3.0;                    // 1/s
constexpr double kInternals[] = {0.5, 2.0, 8.0};     // 1/s
constexpr double kShown = 2.0;

const std::vector<std::string> kClips = {"cmu_bvh/07_01.bvh", "cmu_bvh/07_02.bvh",
                                         "cmu_bvh/07_03.bvh"};

motion::MotionModel first_pattern(const RecordedWalks& walks, const demix::Mixture& mixture) {
  motion::MotionModel model = motion::make_model(walks.trials, mixture, false, walks.body);
  model.patterns.resize(1);
  return model;
}

const demix::SisaOptions kThreeSources{.sources = 3};

motion::MotionModel principal(const RecordedWalks& walks, int components) {
  return first_pattern(walks, demix::principal_components(walks.trials, components));
}

/// The leader's pull moves the common phase of N oscillators at α/N, for it acts on one of them.
/// This is the α that moves N as fast as kExternal moves three.
double same_pull(int oscillators) { return kExternal * oscillators / 3.0; }

/// The worse of a quarter of a cycle ahead and behind.
Transient worst(const Avatar& leads, const Avatar& follows, double internal, double external) {
  Transient a = come_into_step(leads, follows, {internal, external, -kQuarter});
  const Transient b = come_into_step(leads, follows, {internal, external, kQuarter});
  a.artifact = std::max(a.artifact, b.artifact);
  a.synchronised_s = std::max(a.synchronised_s, b.synchronised_s);
  a.least_step = std::min(a.least_step, b.least_step);
  a.heading_rad = std::max(a.heading_rad, b.heading_rad);
  return a;
}

using Scan = std::vector<Transient>;  // over kInternals

Scan scan(const Avatar& leads, const Avatar& follows, double external) {
  Scan out;
  for (const double k : kInternals) out.push_back(worst(leads, follows, k, external));
  return out;
}

const Transient& best(const Scan& s) {
  return *std::ranges::min_element(s, {}, &Transient::artifact);
}

void add_curves(const Transient& t, const std::string& name, std::vector<Data>& data) {
  const std::size_t n = t.instants.front().phase_rad.size();
  for (std::size_t k = 0; k < n; ++k) data.push_back({name + "p" + std::to_string(k), {}});
  Data artifact{name + "a", {}}, path{name + "path", {}};
  for (const TransientInstant& now : t.instants) {
    for (std::size_t k = 0; k < n; ++k) {
      data[data.size() - n + k].rows.push_back({now.time_s, now.phase_rad[k]});
    }
    artifact.rows.push_back({now.time_s, now.artifact});
    path.rows.push_back({now.position_W_m.x(), now.position_W_m.y()});
  }
  data.push_back(std::move(artifact));
  data.push_back(std::move(path));
}

void plot_network(const std::filesystem::path& png, const Transient& ours, const Transient& pca,
                  const Transient& alone) {
  std::vector<Data> data;
  add_curves(ours, "a", data);
  add_curves(pca, "b", data);
  add_curves(alone, "c", data);
  const auto phases = [](const std::string& name, int n) {
    std::ostringstream s;
    for (int k = 0; k < n; ++k) {
      s << (k ? ", " : "plot ") << '$' << name << 'p' << k << " with lines lw 1.5 notitle";
    }
    return s.str() + '\n';
  };
  const std::string script =
      "set multiplot layout 4,1 title 'A quarter of a cycle behind the leader (M18 fig. 3.31)'\n"
      "set lmargin 11\nset xrange [0:15]\nset yrange [-2:0.7]\nset grid\nset xzeroaxis\n"
      "set ylabel 'phase - leader [rad]'\n"
      "set title 'avatar 1: 3 sources with delays, 3 oscillators'\n" +
      phases("a", 3) + "set title 'avatar 2: 7 principal components, 7 oscillators, as fast'\n" +
      phases("b", 7) +
      "set title 'distance from the own gait / rms of the gait'\nset ylabel 'artifact [1]'\n"
      "set yrange [0:*]\nset xlabel 'time [s]'\n"
      "plot $aa with lines lw 2 title 'avatar 1', $ba with lines lw 2 title 'avatar 2'\n"
      "set title 'paths from above'\nset xlabel 'x [m]'\nset ylabel 'y [m]'\nset xrange [0:20]\n"
      "set yrange [-1:5]\n"
      "plot $cpath with lines lw 2 lc rgb '#888888' title 'leader', $apath with lines lw 2 lc 1 "
      "title 'avatar 1', $bpath with lines lw 2 lc 2 title 'avatar 2'\nunset multiplot\n";
  plot::plot_png(png, 860, 1100, data, script);
}

constexpr const char* kNothing = "nothing is printed; the text claims artifacts of the PCA avatar";

void scan_rows(const Scan& ours, const Scan& pca, const Scan& pca_as_fast, Report& report) {
  for (std::size_t i = 0; i < std::size(kInternals); ++i) {
    std::ostringstream k;
    k << "k = " << kInternals[i] << "/s: ";
    report.at_least(k.str() + "same pull: artifact of PCA / ours",
                    pca_as_fast[i].artifact / ours[i].artifact, published(1.0, "M18 3.6"), "1",
                    kNothing);
    report.at_least(k.str() + "same couplings: time of PCA / ours",
                    pca[i].synchronised_s / ours[i].synchronised_s, 1.0, "1",
                    "more oscillators are slower: the leader pulls one of them");
  }
  report.at_most("best k, ours: artifact", best(ours).artifact, 0.5, "1", "of the gait's rms");
  report.at_least("best k of each, same pull: artifact of PCA / ours",
                  best(pca_as_fast).artifact / best(ours).artifact, published(1.0, "M18 3.6"), "1",
                  kNothing);
  report.at_most("best k of each, same couplings: artifact of PCA / ours",
                 best(pca).artifact / best(ours).artifact, 1.0, "1",
                 "PCA that may take its time looks better; the text's claim is not general");
  report.at_most("best k, ours: turns by", best(ours).heading_rad, 0.5, "rad",
                 "foot contact turns");
  report.at_most("best k of each, same pull: turning of PCA / ours",
                 best(pca_as_fast).heading_rad / best(ours).heading_rad, 1.0, "1",
                 "the text sees the PCA avatar turn more: not so here");
  report.at_most("PCA: time at the strongest k / at the middle one",
                 pca[2].synchronised_s / pca[1].synchronised_s, 1.05, "1",
                 "the text says stronger coupling slows it down: not so here");
  report.at_most("PCA, same pull: least step at the strongest k", pca_as_fast[2].least_step,
                 published(1.0, "M18 3.6"), "1",
                 "of the steady step: below 1 it shrinks, as the text says");
  report.at_most("ours: least step at the strongest k", ours[2].least_step, 1.0, "1",
                 "shrinks as well: pulled oscillators lose amplitude");
}

Report followers(const PlotDir& dir) {
  if (const auto clip = absent_clip(kClips); !clip.empty()) return report_absent(clip);
  const RecordedWalks walks = recorded_walks(kClips);
  const demix::Mixture mixture = demix::sisa(walks.trials, kThreeSources).mixture;
  const Avatar ours(first_pattern(walks, mixture)), pca(principal(walks, 7)),
      more(principal(walks, 12));
  const double free_phases =
      demix::quality(walks.trials.samples, demix::sinusoids(walks.trials, 3).reconstruct());
  const auto learn_pca = [](const mocap::Trials& t) { return demix::principal_components(t, 7); };
  Report report;
  report.rows = {
      at_least("Q of the mixture with delays, 3 sources", ours.model.quality, 0.9, "1",
               "CMU 07, four cycles of normal walks"),
      at_least("the same, each clip left out once",
               demix::sisa_held_out(walks.trials, kThreeSources, mixture).quality, free_phases, "1",
               "3 sinusoids with free phases, which learn nothing; weights, means and delays are "
               "fitted"),
      near("Q of 7 principal components", pca.model.quality,
           published(ours.model.quality, "M18 3.6"), 0.02, "1"),
      at_most("the same, each clip left out once",
              demix::held_out(walks.trials, demix::Delays::none, false, learn_pca).quality,
              pca.model.quality, "1", "in-sample; weights and means are fitted"),
  };
  scan_rows(scan(ours, ours, kExternal), scan(ours, pca, kExternal), scan(ours, pca, same_pull(7)),
            report);
  const Transient twelve = worst(ours, more, 8.0, same_pull(12));
  const Transient three = worst(ours, ours, 8.0, kExternal);
  report.at_least("12 components, k = 8/s, same pull: artifact of PCA / ours",
                  twelve.artifact / three.artifact, published(1.0, "M18 3.6"), "1",
                  "the text: similar problems remain");
  if (dir) {
    report.plots.push_back(*dir / "fig-3.31.png");
    const double behind = -kQuarter;
    plot_network(report.plots.back(), come_into_step(ours, ours, {kShown, kExternal, behind}),
                 come_into_step(ours, pca, {kShown, same_pull(7), behind}),
                 come_into_step(ours, ours, {kShown, kExternal, 0.0}));
  }
  return report;
}

}  // namespace

void add_network_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-3.31", "coming into step with a leader: mixture with delays against PCA",
                  "M18", Declared{.published = 7, .goal = 12}, followers);
}

}  // namespace mimesis::synthesizer
