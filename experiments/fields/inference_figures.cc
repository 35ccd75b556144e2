#include <algorithm>
#include <cmath>

#include "experiments/fields/figures.h"
#include "experiments/fields/ladder_plots.h"

namespace mimesis::cognition {
namespace {

using reproduce::goal;
using reproduce::holds;
using reproduce::near;
using reproduce::prototype;
using reproduce::published;
using reproduce::Report;
using PlotDir = std::optional<std::filesystem::path>;

constexpr double kTolerance_ms = 3.0;  // times are counted at the end of a step here

/// A robot that is familiar with the task: both preferred sequences learned by eq. 2.3.
Ladder<double> familiar() {
  Ladder<double> ladder({});
  rehearse(ladder, parse_sequence("precision,above,high"));
  rehearse(ladder, parse_sequence("full,below,low"));
  return ladder;
}

bool decides(const TrialResult& r, Grip grip, Transport transport, Goal goal) {
  return r.decision.settled && r.decision.grip == grip && r.decision.transport == transport &&
         r.decision.goal == goal;
}

void plot(Report& report, const PlotDir& dir, const std::string& name, const std::string& title,
          const Recording& r) {
  if (!dir) return;
  report.plots.push_back(*dir / (name + ".png"));
  plot_snapshot(report.plots.back(), title, r);
  report.plots.push_back(*dir / (name + "-time.png"));
  plot_courses(report.plots.back(), title, r, -0.05, 0.3);
}

/// Fig. 2.20: only the full grip is seen.
Report inference(const PlotDir& dir) {
  Report report;
  Ladder<double> ladder = familiar();
  const Demonstration grip_only{.grip = Grip::full};
  const Recording seen = record(ladder, {.shown = grip_only});
  const TrialResult& r = seen.result;
  const auto time = [&](const char* what, Layer layer, double reference_ms) {
    report.rows.push_back(near(what, 1000 * r.onset(layer), prototype(reference_ms, "fields.md"),
                               kTolerance_ms, "ms"));
  };
  time("PF decides for FG-BT", Layer::pf, 99);
  time("F5 decides for FG", Layer::f5_grip, 114);
  time("F5 decides for BT", Layer::f5_transport, 126);
  time("PFC infers the low goal", Layer::pfc, 151);
  report.rows.push_back(holds(
      "order STS, PF, PFC",
      r.onset(Layer::sts_grip) < r.onset(Layer::pf) && r.onset(Layer::pf) < r.onset(Layer::pfc),
      published("M18 2.4.2")));
  report.rows.push_back(
      holds("PF holds FG-BT", r.site(Layer::pf) == kFgBt, published("M18 2.4.2")));
  report.rows.push_back(holds("decision: FG, BT, low",
                              decides(r, Grip::full, Transport::below, Goal::low),
                              published("M18 fig. 2.20")));
  report.rows.push_back(
      holds("the transport was not seen", r.site(Layer::sts_transport) < 0, goal()));

  const TrialResult mirror = run_trial(ladder, {.shown = {.grip = Grip::precision}});
  report.rows.push_back(holds("PG alone: decision PG, AT, high",
                              decides(mirror, Grip::precision, Transport::above, Goal::high),
                              goal()));
  const TrialResult unready =
      run_trial(ladder, {.shown = grip_only, .task = {.pf = 0.0, .pfc = 0.0}});
  bool only_sts = unready.site(Layer::sts_grip) == 1;
  for (const Layer layer : kAllLayers) {
    only_sts = only_sts && (layer == Layer::sts_grip || std::isnan(unready.onset(layer)));
  }
  report.rows.push_back(holds("control, no task input: nothing but STS becomes active", only_sts,
                              prototype("fields.md")));
  Ladder<double> novice({});
  const TrialResult untrained = run_trial(novice, {.shown = grip_only});
  report.rows.push_back(
      holds("control, never practised: no goal is inferred",
            std::isnan(untrained.onset(Layer::pfc)) && !untrained.decision.settled, goal()));
  plot(report, dir, "fig-2.20", "Fig. 2.20: only the full grip was seen; the low goal is inferred",
       seen);
  return report;
}

/// Fig. 2.21: full grip, above, high goal; the robot's bridge has a bar.
Report override_means(const PlotDir& dir) {
  Report report;
  Ladder<double> ladder = familiar();
  const Demonstration shown{.grip = Grip::full, .transport = Transport::above, .goal = Goal::high};
  const Recording seen = record(ladder, {.shown = shown});
  const TrialResult& r = seen.result;
  report.rows.push_back(near("PFC decides for the high goal", 1000 * r.onset(Layer::pfc),
                             prototype(24, "fields.md"), kTolerance_ms, "ms"));
  report.rows.push_back(near("PF decides for PG-AT", 1000 * r.onset(Layer::pf),
                             prototype(40, "fields.md"), kTolerance_ms, "ms"));
  report.rows.push_back(near("STS holds the full grip", 1000 * r.onset(Layer::sts_grip),
                             prototype(49, "fields.md"), kTolerance_ms, "ms"));
  report.rows.push_back(holds(
      "order PFC, PF, STS",
      r.onset(Layer::pfc) < r.onset(Layer::pf) && r.onset(Layer::pf) < r.onset(Layer::sts_grip),
      prototype("fields.md")));
  report.rows.push_back(
      holds("STS saw the full grip", r.site(Layer::sts_grip) == 1, published("M18 fig. 2.21")));
  report.rows.push_back(holds("decision: PG, AT, high",
                              decides(r, Grip::precision, Transport::above, Goal::high),
                              published("M18 fig. 2.21")));
  report.rows.push_back(near("highest activity of FG in F5", seen.highest_at(Layer::f5_grip, 1),
                             prototype(-1.44, "fields.md"), 0.1, "1"));

  Ladder<double> lesioned = familiar();
  lesioned.cut(Connection::pfc_pf);
  const Recording lesion = record(lesioned, {.shown = shown});
  report.rows.push_back(holds("lesion PFC->PF: F5 copies the full grip",
                              lesion.result.site(Layer::f5_grip) == 1, prototype("fields.md")));
  const TrialResult no_habit =
      run_trial(lesioned, {.shown = shown, .task = {.pf = 0.0, .pfc = lesioned.params().task.pfc}});
  report.rows.push_back(holds("lesion, no task input to PF: PF holds FG-AT, F5 copies FG and AT",
                              no_habit.site(Layer::pf) == kFgAt &&
                                  no_habit.site(Layer::f5_grip) == 1 &&
                                  no_habit.site(Layer::f5_transport) == 0,
                              prototype("fields.md")));
  plot(report, dir, "fig-2.21",
       "Fig. 2.21: full grip seen on the way to the high goal; precision grip decided", seen);
  if (dir) {
    report.plots.push_back(*dir / "fig-2.21-lesion.png");
    plot_snapshot(report.plots.back(), "Fig. 2.21, lesion of PFC->PF: the full grip is copied",
                  lesion);
  }
  return report;
}

}  // namespace

void add_inference_figures(std::vector<reproduce::Figure>& to) {
  to.push_back({"fig-2.20",
                "The goal is inferred from the grip alone",
                "M18",
                {.published = 3, .prototype = 5, .goal = 3},
                inference});
  to.push_back({"fig-2.21",
                "The goal overrides the means that were seen",
                "M18",
                {.published = 2, .prototype = 7},
                override_means});
}

}  // namespace mimesis::cognition
