// The drawer task played online [M18 3.7].
#include <algorithm>
#include <cmath>

#include "experiments/motion/drawer_training.h"
#include "experiments/motion/figures.h"

namespace mimesis::synthesizer {
namespace {

using namespace reproduce;

void quality_rows(const DrawerRun& run, const std::string& what, Report& report) {
  const SequenceState& end = run.states.back();
  report.near(what + ": distance of the stand", run.final_distance_m, published(0.6, "M18 3.4.2"),
              0.01, "m");
  report.at_most(what + ": hands to handle and object",
                 std::max(end.left_error_m, end.right_error_m), published(0.01, "M18 3.8.3"), "m",
                 "printed for the robot's reaching errors");
  report.at_most(what + ": speed of standing feet", run.foot_speed_m_s,
                 prototype(0.083, "motion.md"), "m/s", "recorded feet slide as fast");
}

// Rows for the errors of the learned mixture, before feet are held and arms reach.
void mixture_rows(const DrawerRun& run, const std::string& what, Report& report) {
  const SequenceState& end = run.states.back();
  const auto stand =
      std::ranges::find_if(run.states, [](const auto& s) { return s.action == kStanding; });
  report.at_most(what + ": the mixture alone, left hand as the stand begins", stand->left_without_m,
                 0.03, "m", "then the reach makes up for it");
  report.at_most(what + ": the mixture alone, worse hand at the end",
                 std::max(end.left_without_m, end.right_without_m), 0.05, "m",
                 "then the reach makes up for it");
  report.at_most(what + ": correction of the feet, rms", run.foot_correction_m, 0.08, "m",
                 "then the feet are held");
}

// The interval of distances around the published one that n normal cycles and one shortened step
// reach within the trained range.
double reachable_range(int cycles) {
  const ActionRanges& r = drawer_maps().ranges();
  return cycles * (r.normal.most_m - r.normal.least_m) + r.reaching.most_m - r.reaching.least_m;
}

// Range of the lengths as drawn, before the paces were changed.
double drawn_range(int cycles) {
  double least[2] = {9.0, 9.0}, most[2] = {0.0, 0.0};
  for (const int a : {0, 1})
    for (std::size_t i = 0; i < 10; ++i) {
      const double x = drawer_data().action[static_cast<std::size_t>(a)].trials[i].step_length_m;
      least[a] = std::min(least[a], x);
      most[a] = std::max(most[a], x);
    }
  return cycles * (most[0] - least[0]) + most[1] - least[1];
}

/// From distances that were not trained [M18 fig. 3.37].
Report two_distances(const PlotDir&) {
  Report report;
  for (const double d : {2.34, 2.45, 2.85, 2.94}) {
    const DrawerRun run = run_drawer(d);
    const std::string what = std::to_string(d).substr(0, 4) + " m";
    report.near(what + ": actions", static_cast<double>(run.history.size()),
                published(3, "M18 3.7"), 0, "1");
    quality_rows(run, what, report);
    mixture_rows(run, what, report);
  }
  for (const auto& [d, cycles] : {std::pair{3.84, 2}, {4.62, 2}, {5.3, 3}}) {
    const DrawerRun run = run_drawer(d);
    const std::string what = std::to_string(d).substr(0, 4) + " m";
    report.near(what + ": normal cycles", run.count(kNormalStep),
                d == 5.3 ? published(cycles, "M18 3.7") : goal(cycles), 0, "1");
    quality_rows(run, what, report);
  }
  report.near("range of distances with three actions, lengths as drawn", drawn_range(1),
              published(0.60, "M18 3.7"), 0.15, "m");
  report.near("range with one more, lengths as drawn", drawn_range(2), published(0.78, "M18 3.7"),
              0.15, "m");
  report.at_least("range with three actions, trained lengths", reachable_range(1),
                  published(0.60, "M18 3.7"), "m", "the paces widen it");
  report.at_least("range with one more, trained lengths", reachable_range(2),
                  published(0.78, "M18 3.7"), "m", "the paces widen it");
  double worst = 0.0;
  for (int i = 0; i <= 150; ++i) {
    const double d = 0.7 + 0.05 * i;
    const auto plan = plan_actions(d, drawer_maps().ranges());
    double end = plan ? d : 9.6;
    for (const PlannedAction& action : plan.value_or(std::vector<PlannedAction>{})) {
      end -= action.length_m;
    }
    worst = std::max(worst, std::abs(end - 0.6));
  }
  report.at_most("0.7 to 8.2 m: largest error of the final distance", worst, 0.085, "m",
                 "what arms and trunk make up for");
  return report;
}

SequenceState at_stand(double distance_m) {
  const DrawerRun run = run_drawer(distance_m);
  return *std::ranges::find_if(run.states, [](const auto& s) { return s.action == kStanding; });
}

Report posture_before_stand(const PlotDir&) {
  Report report;
  const PlanSettings settings;
  auto second = [&](double d) {
    return (d - settings.final_distance_m) * (1.0 - 2.0 * settings.gamma);
  };
  report.near("length of action 2 for the farthest start, 2.94 m", second(2.94),
              published(0.53, "M18 fig. 3.38"), 0.015, "m");
  report.near("length of action 2 for the nearest start, 2.34 m", second(2.34),
              published(0.39, "M18 fig. 3.38"), 0.015, "m");
  auto distance = [&](double length) {
    return settings.final_distance_m + length / (1.0 - 2.0 * settings.gamma);
  };
  const SequenceState far = at_stand(distance(0.53)), near_by = at_stand(distance(0.39));
  const Eigen::VectorXd difference = far.angle_rad - near_by.angle_rad;
  double most = 0.0;
  for (int j = 0; j < mocap::kBodyJoints; ++j)
    most = std::max(most, difference.segment<3>(3 * j).norm());
  constexpr double kDegree = 180.0 / 3.14159265358979323846;
  report.at_least("largest difference of a joint at the same distance to the drawer",
                  most * kDegree, 2.0, "deg", "0 if the step before did not count");
  return report;
}

constexpr double kStart = 2.64;
const std::vector<DrawerJump> kJump = {{1.6, 0.5}};

Report jump(const PlotDir&) {
  Report report;
  const DrawerRun calm = run_drawer(kStart), jumped = run_drawer(kStart, kJump);
  report.near("actions without the jump", static_cast<double>(calm.history.size()),
              published(3, "M18 3.7"), 0, "1");
  report.near("short steps (type 2) with it", jumped.count(kReachingStep),
              published(2, "M18 fig. 3.39"), 0, "1");
  quality_rows(jumped, "jump by 0.5 m in action 2", report);
  int followed = 0, all = 0;
  double worst = 0.0;
  for (double t = 0.2; t < 3.9; t += 0.4)
    for (const double by : {0.2, 0.5, 1.0}) {
      const DrawerRun run = run_drawer(kStart, {{t, by}});
      ++all;
      followed += run.states.back().refused.empty() && run.states.back().done ? 1 : 0;
      worst = std::max(worst, std::abs(run.final_distance_m - 0.6));
    }
  report.near("jumps by 0.2, 0.5, 1 m at any time: share followed",
              static_cast<double>(followed) / all, goal(1.0), 0.0, "1");
  report.at_most("their largest error of the final distance", worst, 0.085, "m",
                 "what arms and trunk make up for");
  return report;
}

}  // namespace

void add_drawer_motion_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-3.37", "walking to a drawer from distances that were not trained", "M18",
                  Declared{.published = 23, .prototype = 7, .goal = 15}, two_distances);
  to.emplace_back("fig-3.38", "posture before the stand depends on the step before", "M18",
                  Declared{.published = 2, .goal = 1}, posture_before_stand);
  to.emplace_back("fig-3.39", "the drawer jumps away during the approach", "M18",
                  Declared{.published = 4, .prototype = 1, .goal = 2}, jump);
}

}  // namespace mimesis::synthesizer
