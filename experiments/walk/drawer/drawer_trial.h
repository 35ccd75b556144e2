#pragma once
#include <functional>
#include <string>
#include <vector>

#include "hw/sim/body/drawer.h"
#include "nodes/synthesizer/robot/biped_sequence.h"
#include "experiments/walk/trial/trial.h"

namespace mimesis::walk {

/// The drawer task in one process: synthesizer's sequence, walker, physics, drawer; each hears of
/// the others what it would over the bus [M18 3.8].
struct DrawerTrialSpec {
  std::string name;
  const Robot* robot = nullptr;
  const synthesizer::BipedDrawer* actions = nullptr;
  /// Closed front ahead, and to the left, of the middle of the feet at the start.
  double front_m = 1.7, left_m = 0.0;
  double object_depth_m = 0.2;
  std::vector<hw::sim::DrawerJump> jumps;
  synthesizer::BipedSequenceOptions sequence;
  hw::sim::BodyOptions body;
  walker::WalkerSettings walker;
  std::vector<hw::sim::Push> pushes;
  double stand_s = 1.0;        ///< before it begins
  double time_limit_s = 30.0;  ///< of the whole
  int delay_ticks = 1;         ///< of sensors on their way to the walker
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
  double reach_error_m = 0.0, handle_error_m = 0.0;  ///< of the hands when they gripped
  /// Of each action but the standing one: travel of the middle of the true feet, and what was
  /// planned when it began.
  struct ActionLength {
    synthesizer::Action action;
    double wished_m, walked_m;
  };
  std::vector<ActionLength> lengths;
  double length_error_max_m() const;
};

/// Deterministic but for times. Ends when the object has been held for a second, with a fall, or
/// with the time limit.
DrawerResult run_drawer_trial(const DrawerTrialSpec& spec,
                              const std::function<void(const DrawerTick&)>& watch = {});

}  // namespace mimesis::walk
