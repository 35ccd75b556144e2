#include <algorithm>
#include <cmath>

#include "experiments/fields/figures.h"
#include "experiments/fields/network_plots.h"
#include "experiments/fields/situations.h"

namespace mimesis::cognition {
namespace {

using namespace reproduce;

/// Both preferred sequences learned by eq. 2.3.
FieldNetwork<double> familiar() { return practised<double>({}, Practice::familiar); }

bool decides(const TrialResult& r, Grip grip, Transport transport, Goal goal) {
  return r.decision.settled && r.decision.grip == grip && r.decision.transport == transport &&
         r.decision.goal == goal;
}

void plot(Report& report, const PlotDir& dir, const std::string& name, const std::string& title,
          const Recording& r) {
  if (!dir) return;
  plot_snapshot(report.picture(*dir / (name + ".png")), title, r);
  plot_courses(report.picture(*dir / (name + "-time.png")), title, r, -0.05, 0.3);
}

/// Fig. 2.20: only the full grip is seen.
Report inference(const PlotDir& dir) {
  Report report;
  FieldNetwork<double> network = familiar();
  const Demonstration grip_only{.grip = Grip::full};
  const Recording seen = record(network, {.shown = grip_only});
  const TrialResult& r = seen.result;
  report.holds(
      "order STS, PF, PFC",
      r.onset(Layer::sts_grip) < r.onset(Layer::pf) && r.onset(Layer::pf) < r.onset(Layer::pfc),
      published("M18 2.4.2"));
  report.holds("PF holds FG-BT", r.site(Layer::pf) == kFgBt, published("M18 2.4.2"));
  report.holds("decision: FG, BT, low", decides(r, Grip::full, Transport::below, Goal::low),
               published("M18 fig. 2.20"));
  report.holds("the transport was not seen", r.site(Layer::sts_transport) < 0, goal());

  const TrialResult mirror = run_trial(network, {.shown = {.grip = Grip::precision}});
  report.holds("PG alone: decision PG, AT, high",
               decides(mirror, Grip::precision, Transport::above, Goal::high), goal());
  const TrialResult unready = run_trial(network, {.shown = grip_only, .task = kNoTask});
  bool only_sts = unready.site(Layer::sts_grip) == 1;
  for (const Layer layer : kAllLayers) {
    only_sts = only_sts && (layer == Layer::sts_grip || std::isnan(unready.onset(layer)));
  }
  report.holds("control, no task input: nothing but STS becomes active", only_sts,
               prototype("fields.md"));
  FieldNetwork<double> novice(load_network());
  const TrialResult untrained = run_trial(novice, {.shown = grip_only});
  report.holds("control, never practised: no goal is inferred",
               std::isnan(untrained.onset(Layer::pfc)) && !untrained.decision.settled, goal());
  plot(report, dir, "fig-2.20", "Fig. 2.20: only the full grip was seen; the low goal is inferred",
       seen);
  return report;
}

/// Fig. 2.21: full grip, above, high goal; the robot's obstacle has a bar.
Report override_means(const PlotDir& dir) {
  Report report;
  FieldNetwork<double> network = familiar();
  const Demonstration shown{.grip = Grip::full, .transport = Transport::above, .goal = Goal::high};
  const Recording seen = record(network, {.shown = shown});
  const TrialResult& r = seen.result;
  report.holds(
      "order PFC, PF, STS",
      r.onset(Layer::pfc) < r.onset(Layer::pf) && r.onset(Layer::pf) < r.onset(Layer::sts_grip),
      published("M18 2.4.3: the goal is processed faster"));
  report.holds("STS saw the full grip", r.site(Layer::sts_grip) == 1, published("M18 fig. 2.21"));
  report.holds("decision: PG, AT, high", decides(r, Grip::precision, Transport::above, Goal::high),
               published("M18 fig. 2.21"));
  report.at_most("highest activity of FG in F5", seen.highest_at(Layer::f5_grip, 1), 0.0, "1",
                 "the grip that was seen is never even begun");

  FieldNetwork<double> lesioned = practised<double>({}, Practice::lesioned);
  const TaskInput no_habit{.means = 0.0};
  const Recording lesion = record(lesioned, {.shown = shown, .task = no_habit});
  const Sites copied = {1, 0, kFgAt, 1, 0, 0, -1};
  report.holds("lesion of PFC->PF: PF holds FG-AT, F5 copies FG and AT",
               sites_of(lesion.result) == copied, prototype("fields.md"));
  report.holds("control, links whole and no habit: PF holds PG-AT, F5 PG and AT",
               sites_of(run_trial(network, {.shown = shown, .task = no_habit})) ==
                   Sites{1, 0, kPgAt, 0, 0, 0, -1},
               goal());
  plot(report, dir, "fig-2.21",
       "Fig. 2.21: full grip seen on the way to the high goal; precision grip decided", seen);
  if (dir)
    plot_snapshot(report.picture(*dir / "fig-2.21-lesion.png"),
                  "Fig. 2.21, lesion of PFC->PF: the full grip is copied", lesion);
  return report;
}

/// Fig. 2.22: while FG is observed, a test plan with this grip decides between PG-AT and FG-AT.
Report test_plan(const PlotDir& dir) {
  Report report;
  FieldNetwork<double> network = familiar();
  const Demonstration full_above{.grip = Grip::full, .transport = Transport::above};
  const Demonstration full_below{.grip = Grip::full, .transport = Transport::below};
  const Recording preferred = record(network, dialogue({}));
  const Recording copied = record(network, dialogue(full_above));
  const TrialResult& r = copied.result;
  double before_plan = -10.0;  // while only the grasp was seen
  for (std::size_t i = 0; i < copied.time_s.size() && copied.time_s[i] < kPlanned_s; ++i) {
    before_plan = std::max(before_plan, copied.max_u[index(Layer::pf)][i]);
  }
  report.at_most("before the test plan: most active neuron of PF", before_plan,
                 published(0.0, "M18 2.4.3: STS sends subthreshold input"), "1", "u_TH");
  report.holds("the decision falls after the test plan, before the goal is seen",
               r.onset(Layer::pf) > kPlanned_s && r.onset(Layer::pf) < kPlaced_s,
               published("M18 2.4.3"));
  report.holds("left column, no test plan: PG and AT, the preferred strategy",
               sites_of(preferred.result) == Sites{1, -1, kPgAt, 0, 0, 0, -1},
               published("M18 fig. 2.22"));
  report.holds("right column, test plan for FG, AT: FG and AT, high goal",
               sites_of(r) == Sites{1, -1, kFgAt, 1, 0, 0, -1}, published("M18 fig. 2.22"));
  report.holds(
      "had the test plan found FG, BT: FG and BT",
      sites_of(run_trial(network, dialogue(full_below))) == Sites{1, -1, kFgBt, 1, 1, 0, -1},
      goal());
  FieldNetwork<double> cut = familiar();
  cut.cut("F5g->PF");
  cut.cut("F5t->PF");
  report.holds("control, F5->PF cut: the test plan does not reach PF",
               run_trial(cut, dialogue(full_above)).site(Layer::pf) == kPgAt, goal());
  if (dir) {
    plot_snapshot(report.picture(*dir / "fig-2.22.png"),
                  "Fig. 2.22, right: a test plan for FG, AT lets the robot copy the grip", copied);
    plot_snapshot(report.picture(*dir / "fig-2.22-left.png"),
                  "Fig. 2.22, left: the preferred strategy", preferred);
    plot_courses(report.picture(*dir / "fig-2.22-time.png"),
                 "Fig. 2.22: grasp at 0 ms, test plan at 300 ms, goal seen at 800 ms", copied,
                 -0.05, 1.3);
  }
  return report;
}

}  // namespace

void add_inference_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-2.20", "The goal is inferred from the grip alone", "M18",
                  Declared{.published = 3, .prototype = 1, .goal = 3}, inference);
  to.emplace_back("fig-2.21", "The goal overrides the means that were seen", "M18",
                  Declared{.published = 3, .prototype = 1, .goal = 2}, override_means);
  to.emplace_back("fig-2.22", "A test plan of the planner decides whether the grip is copied",
                  "M18", Declared{.published = 4, .goal = 2}, test_plan);
}

}  // namespace mimesis::cognition
