#include <cmath>
#include <cstring>
#include <sstream>

#include "experiments/fields/figures.h"
#include "experiments/fields/network_plots.h"
#include "experiments/fields/situations.h"

namespace mimesis::cognition {
namespace {

using namespace reproduce;

std::vector<double> weights(const FieldNetwork<double>& network, const char* c) {
  const auto n = static_cast<std::size_t>(network.field(Layer::pf).params().neurons);
  std::vector<double> all;
  for (std::size_t y = 0; y < n; ++y) {
    for (std::size_t x = 0; x < n; ++x) all.push_back(network.link(c).weight(x, y));
  }
  return all;
}

/// Largest difference of the learned PF->PFC weights to eq. 2.4 at the present activity, relative.
double distance_to_closed_form(const FieldNetwork<double>& network) {
  const auto r1 = network.field(Layer::pfc).rate(), r2 = network.field(Layer::pf).rate();
  const double local = network.field(Layer::pf).f2(network.spec().learning.local_above);
  double worst = 0.0, largest = 0.0;
  for (std::size_t y = 0; y < r2.size(); ++y) {
    for (std::size_t x = 0; x < r1.size(); ++x) {
      const bool both = r1[x] >= local && r2[y] >= local;
      const double exact = both ? network.eta("PF->PFC") * r1[x] * r2[y] : 0.0;
      worst = std::max(worst, std::abs(network.link("PF->PFC").weight(x, y) - exact));
      largest = std::max(largest, exact);
    }
  }
  return worst / largest;
}

/// Figs. 2.17 and 2.18: the robot that has not learned yet copies a complete demonstration, then
/// learns.
Report copying(const Demonstration& shown, int pf, int site, const std::string& title,
               const std::string& name, const PlotDir& plot_dir) {
  Report report;
  FieldNetwork<double> network(load_network());
  const auto untouched = weights(network, "PF->PFC");
  const Recording r = record(network, {.shown = shown});
  const auto label = [&](Layer layer, int expected) {
    const Peaks& peaks = r.result.peaks[index(layer)];
    std::ostringstream what;
    what << "one peak in " << layer_name(layer) << ", at " << site_label(layer, expected);
    report.holds(what.str(), peaks.count == 1 && peaks.site == expected, published("M18 " + name));
  };
  label(Layer::sts_grip, site);
  label(Layer::sts_transport, site);
  label(Layer::pf, pf);
  label(Layer::f5_grip, site);
  label(Layer::f5_transport, site);
  label(Layer::pfc, site);
  report.holds("the colour field stays at rest", r.result.site(Layer::color) < 0, goal());
  report.holds("without reward the links keep every bit", weights(network, "PF->PFC") == untouched,
               closed_form("eq. 2.3 times 0"));
  const bool rewarded = rehearse(network, shown);
  run_trial(network, {.shown = shown});
  report.near("links after 2 s of reward: distance to eq. 2.4",
              rewarded ? distance_to_closed_form(network) : 1.0,
              closed_form(std::exp(-5.0), "eq. 2.3 after 5 τ_s"), 0.003, "1");
  const TrialResult alone = run_trial(network, {});
  bool quiet = true;
  for (const Layer layer : kAllLayers) quiet = quiet && std::isnan(alone.onset(layer));
  report.holds("control: task input alone ignites no field, trained or not", quiet,
               published("M18 2.4.2"));
  if (plot_dir) plot_snapshot(report.picture(*plot_dir / (name + ".png")), title, r);
  return report;
}

/// The caption of fig. 2.17 names the lower target, its text the higher: a robot that has practised
/// nothing copies both.
void copying_to_low(Report& report, const PlotDir& plot_dir) {
  FieldNetwork<double> network(load_network());
  const Recording r = record(network, {.shown = task::parse_demonstration("precision,above,low")});
  report.holds("caption: PFC holds the low goal", r.result.site(Layer::pfc) == 1,
               published("M18 fig. 2.17, caption"));
  report.holds("caption: PF and F5 hold the same means, PG and AT",
               sites_of(r.result) == Sites{0, 0, kPgAt, 0, 0, 1, -1},
               published("M18 fig. 2.17, caption"));
  if (!plot_dir) return;
  plot_snapshot(report.picture(*plot_dir / "fig-2.17-low.png"),
                "Fig. 2.17, caption: the same means, to the low goal", r);
}

/// Factors of the task input to PFC.
constexpr std::array<double, 6> kStrengths = {1.0, 0.75, 0.5, 0.25, 0.1, 0.0};

void plot_switch(const std::filesystem::path& png, const std::vector<Recording>& runs) {
  std::vector<plot::Data> data = {course("sts", runs.back(), Layer::sts_grip)};
  std::ostringstream script;
  script << "set multiplot layout 1,2\nset xrange [-20:280]\nset yrange [-4:14]\n"
            "set xlabel 'time from the onset of vision [ms]'\nset ylabel 'max u'\nset key bottom "
            "right opaque\n"
            "set arrow from 0,graph 0 to 0,graph 1 nohead lt 7 dt 3\n";
  for (const Layer layer : {Layer::pf, Layer::pfc}) {
    script << "set title '"
           << (layer == Layer::pf ? "A   PF: preferred means, or those shown"
                                  : "B   PFC: the high goal; STS for comparison")
           << "' font 'sans,12'\nplot 0 lt 7 dt 2 notitle";
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const std::string name = std::string(layer_name(layer)) + std::to_string(i);
      data.push_back(course(name, runs[i], layer));
      const int winner = runs[i].result.site(Layer::pf);
      script << ", $" << name << " using 1:2 with lines lt " << (winner == kPgAt ? 1 : 2)
             << (winner == kPgAt ? "" : " dt 2") << " lw " << 1.0 + 1.6 * kStrengths[i]
             << " title 'task " << kStrengths[i]
             << (layer == Layer::pf
                     ? ": " + std::string(winner < 0 ? "none" : site_label(layer, winner))
                     : std::string())
             << "'";
    }
    script << (layer == Layer::pfc ? ", $sts using 1:2 with lines lt 7 title 'STS'\n" : "\n");
  }
  script << "unset multiplot";
  plot::plot_png(png, 1160, 460, data, script.str());
}

/// Fig. 2.19: FG and BT are shown on the way to the high goal, links to both means exist.
Report task_strength(const PlotDir& plot_dir) {
  Report report;
  const Constants constants;
  FieldNetwork<double> network = practised<double>(constants, Practice::both_means);
  std::vector<Recording> runs;
  int switches = 0;
  bool monotone = true, always_high = true, f5_follows = true;
  for (const double factor : kStrengths) {
    const TaskInput task{.goal = factor};
    runs.push_back(
        record(network, {.shown = task::parse_demonstration("full,below,high"), .task = task}));
    const TrialResult& now = runs.back().result;
    always_high = always_high && now.site(Layer::pfc) == 0;
    const int grip = now.site(Layer::pf) == kPgAt ? 0 : 1;
    f5_follows =
        f5_follows && now.site(Layer::f5_grip) == grip && now.site(Layer::f5_transport) == grip;
    if (runs.size() == 1) continue;
    const TrialResult& before = runs[runs.size() - 2].result;
    switches += now.site(Layer::pf) != before.site(Layer::pf) ? 1 : 0;
    monotone = monotone && now.onset(Layer::pfc) > before.onset(Layer::pfc);
  }
  const TrialResult &strong = runs.front().result, &weak = runs.back().result;
  report.holds("strong task input: PF holds the preferred PG-AT", strong.site(Layer::pf) == kPgAt,
               published("M18 fig. 2.19"));
  report.holds("weak task input: PF holds the demonstrated FG-BT", weak.site(Layer::pf) == kFgBt,
               published("M18 fig. 2.19"));
  report.near("switches of PF over the six strengths", switches, goal(1.0), 0.0, "1");
  report.holds("a weaker task input always delays the goal", monotone, published("M18 2.4.1"));
  report.at_least("delay of the goal, weakest / strongest",
                  weak.onset(Layer::pfc) / strong.onset(Layer::pfc), 1.8, "1",
                  "the order of STS between them must not be left to chance");
  const TrialResult agreed = run_trial(
      network, {.shown = task::parse_demonstration("precision,above,high"), .task = {.goal = 0.0}});
  const double delay_ms = 1000 * (weak.onset(Layer::pfc) - agreed.onset(Layer::pfc));
  report.holds("no expectation: the conflict of FG, BT with the goal delays PFC", delay_ms > 0.0,
               published("M18 2.4.1"));
  report.at_least("its delay, against PG, AT shown", delay_ms, 1.0, "ms",
                  "more than one step of integration");
  report.holds("PFC holds the perceived goal in all runs", always_high, published("M18 2.4.1"));
  report.holds("F5 follows PF in all runs", f5_follows, goal());
  if (plot_dir) plot_switch(report.picture(*plot_dir / "fig-2.19.png"), runs);
  return report;
}

}  // namespace

void add_copying_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back(
      "fig-2.17", "Copying the means: precision grip, above the bar, high goal (caption: low)",
      "M18", Declared{.published = 9, .closed_form = 2, .goal = 1}, [](const PlotDir& dir) {
        Report report =
            copying(task::parse_demonstration("precision,above,high"), kPgAt, 0,
                    "Fig. 2.17: precision grip and transport above are copied", "fig-2.17", dir);
        copying_to_low(report, dir);
        return report;
      });
  to.emplace_back("fig-2.18", "Copying the means: full grip, below the bar, low goal", "M18",
                  Declared{.published = 7, .closed_form = 2, .goal = 1}, [](const PlotDir& dir) {
                    return copying(task::parse_demonstration("full,below,low"), kFgBt, 1,
                                   "Fig. 2.18: full grip and transport below are copied",
                                   "fig-2.18", dir);
                  });
  to.emplace_back("fig-2.19",
                  "The strength of the task input decides whether goal or means are imitated",
                  "M18", Declared{.published = 5, .goal = 4}, task_strength);
}

}  // namespace mimesis::cognition
