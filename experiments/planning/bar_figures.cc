
#include <algorithm>
#include <cmath>

#include "common/model/files.h"
#include "experiments/planning/figures.h"
#include "experiments/planning/pictures.h"
#include "nodes/planner/task_plan.h"

namespace mimesis::planner {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using plot::Data;
using namespace reproduce;

constexpr double kMargin = 0.002;  // [m]
constexpr const char* kSide =
    "set xlabel 'x [m]'\nset ylabel 'z [m]'\nset xrange [-0.5:1.2]\nset yrange [-0.1:1.3]";

Report fig_2_6(const PlotDir& dir) {
  const kin::ArmModel arm = model::load_arm("rx90.yaml");
  const kin::Table table = model::load_table("bar_table.yaml");
  const Obstacles obstacles{table.balls, table.boxes, {}, {}};
  CollisionChecker checker(arm, obstacles, 0.0);
  Report report;
  const MatrixXd postures = sample_box(arm.q_min, arm.q_max, 4000, 6);
  const auto free = checker.free_columns(postures);
  int otherwise = 0;
  VectorXd prohibited;
  for (Index i = 0; i < postures.cols(); ++i) {
    const PlacedBalls placed = place(arm, postures.col(i), obstacles);
    const bool is_free = free[static_cast<std::size_t>(i)] != 0;
    otherwise += std::abs(placed.gap_m) > 2e-5 && is_free != (placed.gap_m > 0.0);
    const PlacedBalls bar = place(arm, postures.col(i), {table.balls, {}, {}, {}});
    if (prohibited.size() == 0 && std::ranges::count(bar.touches, 1) > 2 &&
        place(arm, postures.col(i), {{}, table.boxes, {}, {}}).gap_m > 0.0)
      prohibited = postures.col(i);
  }
  report.near("postures judged otherwise than pair by pair", otherwise,
              closed_form(0.0, "distance below the sum of the radii"), 0.0, "1",
              "4000 postures, rounding of 20 um left out");
  report.holds("panel A: a posture is prohibited by the bar alone",
               prohibited.size() > 0 && !checker.free(prohibited), published("figure 2.6"));
  VectorXd target;
  double off = INFINITY;
  for (const kin::IkGoal& grasp :
       grasp_goals(Grip::precision, table.goals[0].position, table.object_height, 0.02)) {
    for (const VectorXd& q : kin::solve_ik_anywhere(arm, grasp, 60, 1)) {
      if (!checker.free(q)) continue;
      const double here = (kin::end_effector(arm, q).translation() - grasp.position_in_W).norm();
      if (here < off) target = q;
      off = std::min(off, here);
    }
  }
  report.at_most("panel B: gripper from its place at the target", 1e3 * off, goal(0.1), "mm",
                 "and no ball touches");
  if (target.size() > 0)
    draw(report, dir, "fig-2.6", 2,
         {posture_panel("A: prohibited", arm, prohibited, obstacles, 2, kSide),
          posture_panel("B: target", arm, target, obstacles, 2, kSide)});
  return report;
}

Report fig_2_8(const PlotDir& dir) {
  const kin::ArmModel arm = model::load_arm("lwr4.yaml");
  const kin::Table table = model::load_table("bar_table.yaml");
  constexpr int kStarts = 10, kPostures = 15;
  Report report;
  const MatrixXd starts = sample_box(arm.q_min, arm.q_max, kStarts, 2);
  const kin::IkGoal target =
      grasp_goals(Grip::precision, table.object, table.object_height, 0.02)[0];
  int postures = 0, half_way = 0;
  double off_line = 0.0;
  Data hands, elbows;
  for (Index i = 0; i < starts.cols(); ++i) {
    const auto way = reaching_postures(arm, starts.col(i), target, kPostures);
    const Vector3d from = kin::end_effector(arm, starts.col(i)).translation();
    const Vector3d along = (target.position_in_W - from).normalized();
    for (const VectorXd& q : way) {
      const Vector3d hand = kin::end_effector(arm, q).translation();
      off_line = std::max(off_line, (hand - from - along * along.dot(hand - from)).norm());
      hands.rows.push_back({hand.x(), hand.z()});
      std::vector<Eigen::Isometry3d> X;
      kin::forward(arm, q, X);
      elbows.rows.push_back({X[3].translation().x(), X[3].translation().z()});
    }
    postures += static_cast<int>(way.size());
    half_way += 2 * static_cast<int>(way.size()) > kPostures;
  }
  report.beside(
      "postures of the reaches to a target", postures, published(150, "2.3.2: 10 paths of 15"), "1",
      "ours keep the hand on a straight line and end at limits of joints; the thesis' curve");
  report.at_least("reaches of more than half of the way", half_way, goal(5), "1",
                  "of 10 from anywhere in the joint space; the goal was set after measuring");
  report.near("hands off the straight line to the target", 1e3 * off_line,
              closed_form(0.0, "reaches are straight in the workspace"), 0.05, "mm",
              "tolerance of the inverse kinematics");
  draw(report, dir, "fig-2.8", 1,
       {{"postures produced by inverse kinematics: hands red, elbows blue",
         {{elbows, dots(kBlue, 0.7)}, {hands, dots(kRed, 0.7)}},
         "set xlabel 'x [m]'\nset ylabel 'z [m]'\nset xrange [-1.2:1.2]\nset yrange [-0.8:1.4]"}});
  return report;
}

/// One task: rows that say whether it was done as decided, and a row of snapshots.
void add_task(Report& report, std::vector<Panel>& panels, const kin::ArmModel& arm,
              const kin::Table& table, const Roadmap& roadmap, const TaskSettings& settings,
              const Task& task, const std::string& where) {
  const std::string name =
      std::string(task.grip == Grip::full ? "full grip, " : "precision grip, ") +
      (task.transport == Transport::below ? "below" : "above") + " the bar, " + task.goal + " goal";
  const auto plan = plan_task(arm, table, roadmap, arm.home, task, settings);
  report.holds(name + ": planned", plan.has_value(), published(where),
               plan ? "" : plan.error().reason);
  if (!plan) return;
  double gap = INFINITY, over_bar = 0.0;
  int crossings = 0;
  std::vector<std::pair<const PlannedMotion*, Index>> shown;
  for (const PlannedMotion& motion : plan->motions) {
    const MatrixXd& q = motion.trajectory.position;
    for (Index k = 0; k < q.cols(); ++k) {
      gap = std::min(gap, place(arm, q.col(k), motion.obstacles).gap_m);
      if (motion.phase != Phase::transport || k == 0) continue;
      const Vector3d a = kin::end_effector(arm, q.col(k - 1)).translation() - table.bar_center,
                     b = kin::end_effector(arm, q.col(k)).translation() - table.bar_center;
      if ((a.x() < 0.0) == (b.x() < 0.0)) continue;
      ++crossings;
      over_bar = b.z();
    }
    if (motion.phase == Phase::transport)
      for (const Index part : {0, 1, 2}) shown.emplace_back(&motion, part * (q.cols() - 1) / 2);
  }
  const bool above = task.transport == Transport::above;
  report.holds(name + ": the hand passes " + (above ? "over" : "under") + " the bar",
               crossings == 1 && (over_bar > 0.0) == above, published(where));
  report.at_least(name + ": least distance", 1e3 * gap, goal(1e3 * kMargin - 0.02), "mm",
                  "every sample, pair by pair; 20 um for the rounding");
  for (const std::size_t i : {0u, 3u, 4u, 5u}) {
    if (i >= shown.size()) continue;
    const auto& [motion, k] = shown[i];
    panels.push_back(posture_panel(i == 0 ? name : "", arm, motion->trajectory.position.col(k),
                                   motion->obstacles, 2, kSide));
  }
}

struct Mounted {
  Task task;
  double base_z_m;
};

Report at_the_bar(const PlotDir& dir, const std::string& figure, const std::string& robot,
                  const std::vector<Mounted>& all, const std::string& where) {
  kin::ArmModel arm = model::load_arm(robot);
  const kin::Table table = model::load_table("bar_table.yaml");
  TaskSettings settings;
  settings.margin_m = kMargin;
  Report report;
  std::vector<Panel> panels;
  for (const Mounted& one : all) {
    arm.X_WB.translation().z() = one.base_z_m;
    const Roadmap roadmap = prepare_roadmap(arm, table, settings);
    add_task(report, panels, arm, table, roadmap, settings, one.task, where);
  }
  if (!panels.empty()) draw(report, dir, figure, 4, panels);
  return report;
}

const Task kBelow{Grip::full, Transport::below, "low"},
    kAbove{Grip::precision, Transport::above, "high"};
// From above, this table's object and high goal are in reach of the Amtec arm's elbow only if it
// stands higher [2.3.2: "in different mounting configurations"].
constexpr double kLowMount_m = 0.1, kHighMount_m = 0.45;

}  // namespace

std::vector<Figure> bar_figures() {
  const auto fig_2_15 = [](const PlotDir& dir) {
    return at_the_bar(dir, "fig-2.15", "lwa7.yaml", {{kBelow, kLowMount_m}, {kAbove, kHighMount_m}},
                      "figure 2.15");
  };
  const auto fig_2_16 = [](const PlotDir& dir) {
    return at_the_bar(dir, "fig-2.16", "lwr4.yaml", {{kBelow, 0.0}, {kAbove, 0.0}}, "figure 2.16");
  };
  return {
      {"fig-2.6", "RX90: prohibited and target posture", "M18", {1, 1, 0, 1}, fig_2_6},
      {"fig-2.8", "Postures produced by inverse kinematics", "M18", {1, 1, 0, 1}, fig_2_8},
      {"fig-2.15", "Amtec arm below and above the bar", "M18", {4, 0, 0, 2}, fig_2_15},
      {"fig-2.16", "KUKA arm below and above the bar", "M18", {4, 0, 0, 2}, fig_2_16},
  };
}

}  // namespace mimesis::planner
