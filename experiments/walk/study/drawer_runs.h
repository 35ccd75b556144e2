#pragma once
#include <cmath>

#include "experiments/walk/drawer/drawer_trial.h"
#include "experiments/walk/study/script.h"
#include "experiments/walk/study/stance_zmp.h"

namespace mimesis::walk {

/// How one walk to the drawer went. Errors that it did not come to are NaN.
struct Outcome {
  bool fell = false, taken = false;
  std::string trouble;
  double fell_at_s = 0.0;
  double ankle_n_m = 0.0, normal_n = 0.0;  ///< peaks until a fall, low-passed by 20 ms
  double zmp_std_m = std::nan("");         ///< see StanceZmp
  double step_error_m = std::nan("");      ///< of soles against the plan, largest of all steps
  /// Of actions' lengths, walked − wished; of several of a kind the largest.
  double normal_error_m = std::nan(""), reaching_error_m = std::nan("");
  double reach_error_m = std::nan("");  ///< of the right hand when it has the object

  /// Of an action that is over: the larger error of its kind stays.
  void note_length(synthesizer::Action action, double error_m);
};

/// Of figures that were taken during a walk; nothing but falls and peaks if no step was planned.
Outcome outcome_of(const TrialResult& result, const StanceZmp& zmp);

/// 30 goals that were in no training trial: 1-10 slow, 11-20 at middle speed, 21-30 fast, as the
/// paces 0.8, 1 and 1.2 of the training trials make steps of the same time.
std::vector<DrawerGoal> novel_goals();
/// 30 goals over the ranges of [M18 3.8.4]: 50.5-56.1 cm, 16.3-35.9 cm, reach 66.3-75.5 cm, depth
/// 12.4-27.3 cm, all growing together.
std::vector<DrawerGoal> extreme_goals();

/// As launch/drawer.yaml has it: a set-point shows in the sensors three ticks later, by way of the
/// bridge, and the stabilizer compares with the plan of five ticks ago [nodes/walker/README.md].
inline constexpr int kSensorDelayTicks = 2;
walker::WalkerSettings launched_walker();

/// The online task whose plan is that of the goal.
DrawerTrialSpec online_spec(const Robot& robot, const synthesizer::BipedDrawer& actions,
                            const DrawerGoal& goal,
                            hw::sim::Plant plant = hw::sim::Plant::kSprings);
/// As run_drawer_trial(), with the watch of it.
Outcome run_online(const DrawerTrialSpec& spec,
                   const std::function<void(const DrawerTick&)>& watch = {});
Outcome run_script(const ScriptRobot& robot, const ActionRows& rows, const DrawerGoal& goal,
                   const DrawerGoal& wished);

}  // namespace mimesis::walk
