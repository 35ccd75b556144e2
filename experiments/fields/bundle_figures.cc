#include <array>
#include <map>
#include <random>

#include "common/model/files.h"
#include "experiments/fields/figures.h"
#include "nodes/cognition/imitator.h"
#include "nodes/cognition/network_file.h"
#include "nodes/cognition/trial.h"
#include "nodes/planner/task_plan.h"

// Motor primitives from the planner's own motions [M18 2.3.1]: planned transports are sorted into
// bundles without labels, F5 and PFC are linked with the bundle that their decision brought about,
// gated by the plan's success, and later decisions pre-select the postures of their bundle. All of
// it as the nodes do it.
namespace mimesis::cognition {
namespace {

using namespace reproduce;

constexpr int kPostures = 12;

/// From -most to most.
double drawn(std::mt19937& random, double most) {
  return most * (static_cast<double>(random()) / 2147483648.0 - 1.0);
}

/// The sequences that the robot practises; other means have no free posture beside the demo's bar.
struct Known {
  planner::Task task;
  const char* sequence;
};
const std::array<Known, 2> kKnown = {
    {{{task::Grip::precision, task::Transport::above, "high"}, "precision,above,high"},
     {{task::Grip::full, task::Transport::below, "low"}, "full,below,low"}}};

class DrawnTable {
 public:
  /// The way with the object, joints x postures, and the length of the whole plan; empty without a
  /// plan.
  struct Planned {
    Eigen::MatrixXd motion;
    double length_rad = 0.0;
  };
  /// The object elsewhere; `elsewhere`: the arm too, and other postures are tried.
  std::optional<Planned> plan(planner::Task task, unsigned seed, bool elsewhere = false,
                              const Eigen::MatrixXd* preselected = nullptr) const {
    constexpr double kMoved_m = 0.015, kAway_rad = 0.8;
    std::mt19937 random(seed);
    kin::Table table = table_;
    table.object.x() += drawn(random, kMoved_m);
    table.object.y() += drawn(random, kMoved_m);
    Eigen::VectorXd start = arm_.home;
    for (const Eigen::Index joint : {0, 1, 2, 3}) {
      if (elsewhere) start[joint] += drawn(random, kAway_rad);
    }
    if (preselected != nullptr) {
      for (const auto& q : preselected->colwise()) task.preselected.emplace_back(q);
    }
    planner::TaskSettings settings = settings_;
    if (elsewhere) settings.roadmap.seed = settings.search.seed = seed;
    const auto plan = planner::plan_task(arm_, table, roadmap_, start, task, settings);
    if (!plan) return std::nullopt;
    Planned planned{Eigen::MatrixXd(arm_.dof(), kPostures), plan->path_length_rad};
    Eigen::Index i = 0;
    for (const auto& q : planner::carried_postures(*plan, kPostures)) planned.motion.col(i++) = q;
    return planned;
  }

 private:
  kin::ArmModel arm_ = model::load_arm("lwr4.yaml");
  kin::Table table_ = model::load_table("bar_table.yaml");
  planner::TaskSettings settings_;
  planner::Roadmap roadmap_ = planner::prepare_roadmap(arm_, table_, settings_);
};

/// Shows a sequence to a robot that waits, until it has decided.
void show(Imitator& robot, const char* sequence) {
  robot.observe({}, false, 0.01);
  for (int i = 0; i < 150; ++i) {
    robot.observe(task::parse_demonstration(sequence), true, 0.01);
    robot.advance(0.01, false);
  }
}

Report learned_bundles(const PlotDir&) {
  Report report;
  const DrawnTable table;
  Imitator robot({}, load_network("bundle_fields.yaml"));
  int silent = 0;
  for (const Known& known : kKnown) {
    show(robot, known.sequence);
    silent += robot.preselected() == nullptr ? 1 : 0;
  }
  report.at_least("before learning: decisions that name no bundle", silent, kKnown.size(), "1",
                  "all kinds that have a plan");

  Bundles sorted(8, ImitatorParams{}.bundle_rad);
  std::map<int, std::map<const char*, int>> of;
  int motions = 0, pure = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    for (const Known& known : kKnown) {
      const auto planned = table.plan(known.task, seed);
      if (!planned) continue;
      ++motions;
      ++of[sorted.add(planned->motion)][known.sequence];
      show(robot, known.sequence);
      if (robot.preselected() != nullptr) continue;
      robot.planned(planned->motion);
      robot.advance(2.0, true);
    }
  }
  for (const auto& [bundle, sequences] : of) {
    pure += std::ranges::max_element(sequences, {}, [](const auto& s) { return s.second; })->second;
  }
  report.at_least("planned transports", motions, 8.0, "1",
                  "two sequences, eight places of the object");
  report.near("bundles found", static_cast<double>(of.size()), goal(4.0), 2.0, "1",
              "one a sequence at least, more where the elbow differs");
  report.at_least("motions in a bundle of their sequence", static_cast<double>(pure) / motions, 0.9,
                  "1", "nobody told the clustering");

  // New scenes: the motion that the decision pre-selects, and none.
  int trials = 0, named = 0, alike_with = 0, alike_without = 0;
  double with_rad = 0.0, without_rad = 0.0;
  for (unsigned seed = 101; seed <= 108; ++seed) {
    for (const Known& known : kKnown) {
      show(robot, known.sequence);
      if (robot.preselected() == nullptr) continue;
      ++named;
      const Eigen::MatrixXd mean = *robot.preselected();
      const auto without = table.plan(known.task, seed, true),
                 with = table.plan(known.task, seed, true, &mean);
      if (!without || !with) continue;
      ++trials;
      const auto alike = [&](const Eigen::MatrixXd& motion) {
        return (motion - mean).colwise().norm().mean() < ImitatorParams{}.bundle_rad ? 1 : 0;
      };
      alike_without += alike(without->motion);
      alike_with += alike(with->motion);
      without_rad += without->length_rad;
      with_rad += with->length_rad;
    }
  }
  report.at_least("learned from one success each: decisions that name their bundle", named, 16.0,
                  "1", "eight new places of the object");
  report.at_least("plans in new scenes", trials, 8.0, "1", "with and without");
  report.at_least("of them within the bundle, with pre-selection",
                  static_cast<double>(alike_with) / trials, goal(0.9), "1",
                  "the way that succeeded before is taken again");
  report.beside("of them within the bundle, without", static_cast<double>(alike_without) / trials,
                goal(0.5), "1", "the planner's own choice");
  report.at_most("length of the plans, with to without", with_rad / without_rad, 1.1, "1",
                 "pre-selected ways are no detours");
  return report;
}

}  // namespace

void add_bundle_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back(
      "fields-bundles",
      "Motor primitives in F5 from bundles of planned motions, and what they pre-select", "own",
      Declared{.goal = 9}, learned_bundles, 1.0);
}

}  // namespace mimesis::cognition
