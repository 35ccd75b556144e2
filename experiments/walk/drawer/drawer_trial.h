#pragma once
#include <functional>
#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "experiments/walk/trial/suites.h"
#include "experiments/walk/trial/trial.h"
#include "hw/sim/body/drawer.h"
#include "nodes/synthesizer/robot/biped_sequence.h"

namespace mimesis::walk {

/// The drawer task in one process: synthesizer's sequence, walker, physics, drawer. Each gets the
/// data of the others that it would get over the bus [M18 3.8].
struct DrawerTrialSpec {
  std::string name;
  const Robot* robot = nullptr;
  const synthesizer::BipedDrawer* actions = nullptr;
  /// Place of the closed front at the start: ahead and to the left of the middle of the feet.
  double front_m = 1.7, left_m = 0.0;
  double object_depth_m = 0.2;
  std::vector<hw::sim::DrawerJump> jumps;
  synthesizer::BipedSequenceOptions sequence;
  hw::sim::BodyOptions body;
  walker::WalkerSettings walker;
  std::vector<hw::sim::Push> pushes;
  double stand_s = 1.0;        ///< before it begins
  double time_limit_s = 30.0;  ///< time limit of the whole trial
  int delay_ticks = 1;         ///< delay of sensor readings on their way to the walker
};

/// One tick, for figures.
struct DrawerTick {
  const TrialTick& trial;
  const synthesizer::BipedSequenceState* state;  ///< null before the sequence begins
  const hw::sim::DrawerNow& drawer;
};

struct DrawerResult {
  TrialResult walk;
  bool taken = false;
  std::string refused;                               ///< why the task could not be done
  double done_s = 0.0;                               ///< when the object was taken
  double reach_error_m = 0.0, handle_error_m = 0.0;  ///< errors of the hands when they gripped
  /// Travel of the middle of the true feet and the plan when the action began, for each action
  /// except the standing one.
  struct ActionLength {
    synthesizer::Action action;
    double wished_m, walked_m;
  };
  std::vector<ActionLength> lengths;
  double length_error_max_m() const;
};

/// Deterministic except for its times. Ends when the object has been held for a second, with a
/// fall, or at the time limit.
DrawerResult run_drawer_trial(const DrawerTrialSpec& spec,
                              const std::function<void(const DrawerTick&)>& watch = {});

/// Thirty drawer tasks at random: fronts 1.2 to 2.8 m away and up to 0.06 rad aside, objects 0.124
/// to 0.273 m deep [M18 3.8.4]; ten drawers stay, ten jump by up to 10 cm either way while the
/// robot is on its way, ten when it is about to stand before it or reaches for it.
/// @param robot, actions  outlive the trials
std::vector<DrawerTrialSpec> drawers30(const Robot& robot, const synthesizer::BipedDrawer& actions,
                                       const SuiteOptions& options);

/// Result of a task.
enum class DrawerEnd {
  taken,
  refused,  ///< the robot stands, with a reason
  fell,
  silent,  ///< not taken, without a reason
};
DrawerEnd end_of(const DrawerResult& result);

/// All of them on `jobs` threads, as run_trials().
void run_drawer_trials(std::span<const DrawerTrialSpec> trials, int jobs,
                       const std::function<void(const DrawerResult&)>& done);

nlohmann::ordered_json to_json(const DrawerResult& result);
/// Number of tasks by result, every task that did not end with the object, and the worst figures of
/// the others.
nlohmann::ordered_json summary_json(std::span<const DrawerResult> results);
/// Prints one row per task in mm, N m, N, µs.
void print_table(std::span<const DrawerResult> results, std::ostream& out, bool bold_heading);

}  // namespace mimesis::walk
