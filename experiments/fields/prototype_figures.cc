#include "experiments/fields/figures.h"
#include "experiments/fields/network_plots.h"
#include "nodes/cognition/network_file.h"

namespace mimesis::cognition {
namespace {

using namespace reproduce;

/// Our network takes the decisions at the times that an independent program measured.
Report times(const PlotDir&) {
  constexpr double kTolerance_ms = 3.0;  // times are counted at the end of a step here
  Report report;
  const NetworkSpec p = load_network("prototype_fields.yaml");
  const auto row = [&](const std::string& what, double onset_s, double reference_ms) {
    report.near(what, 1000 * onset_s, prototype(reference_ms, "fields.md"), kTolerance_ms, "ms");
  };
  FieldNetwork<double> network(p);
  rehearse(network, task::parse_demonstration("precision,above,high"));
  rehearse(network, task::parse_demonstration("full,below,low"));
  const TrialResult grip = run_trial(network, {.shown = {.grip = Grip::full}});
  row("2.20: PF decides for FG-BT", grip.onset(Layer::pf), 99);
  row("2.20: F5 decides for FG", grip.onset(Layer::f5_grip), 114);
  row("2.20: F5 decides for BT", grip.onset(Layer::f5_transport), 126);
  row("2.20: PFC infers the low goal", grip.onset(Layer::pfc), 151);
  const Recording over = record(network, {.shown = task::parse_demonstration("full,above,high")});
  row("2.21: PFC decides for the high goal", over.result.onset(Layer::pfc), 24);
  row("2.21: PF decides for PG-AT", over.result.onset(Layer::pf), 40);
  row("2.21: STS holds the full grip", over.result.onset(Layer::sts_grip), 49);
  report.near("2.21: highest activity of FG in F5", over.highest_at(Layer::f5_grip, 1),
              prototype(-1.44, "fields.md"), 0.1, "1");
  FieldNetwork<double> both(p);
  for (int s = 0; s < 2; ++s) {
    both.install("PF->PFC", s, s);
    both.install("PFC->PF", s, s);
  }
  both.install("PFC->PF", 0, kFgBt, 0.2);
  for (const auto& [factor, pfc_ms] :
       {std::pair{1.0, 25}, {0.75, 30}, {0.5, 36}, {0.25, 43}, {0.1, 49}, {0.0, 54}}) {
    const TrialResult r = run_trial(both, {.shown = task::parse_demonstration("full,below,high"),
                                           .task = {.means = 0.0, .goal = factor}});
    row("2.19: goal decided, task input x " + std::to_string(factor).substr(0, 4),
        r.onset(Layer::pfc), pfc_ms);
  }
  return report;
}

}  // namespace

void add_prototype_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fields-prototype",
                  "Times of decisions with the constants of an independent program", "own",
                  Declared{.prototype = 14}, times);
}

}  // namespace mimesis::cognition
