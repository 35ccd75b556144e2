#pragma once
#include <vector>

#include "nodes/synthesizer/sequence/drawer_sequence.h"

namespace mimesis::synthesizer {

/// The training data of the drawer figures: ten generated trials, and these with the paces 0.8,
/// 0.92 and 1.2 [M18 3.8.3]. Seed 1.
const DrawerData& drawer_data();
/// Learned from them with 3 + 2 periodic sources, with the maps; once per process, some seconds.
const ActionMaps& drawer_maps();

/// A trial whose recording, with its other paces, was left out of all that is learned: sources,
/// delays, weights, widths of the maps. Q is about the mean posture of the others: means count.
struct LeftOutTrial {
  double predicted;  ///< Q of the motion that the maps give for the trial's task; nothing is fitted
  double fitted;     ///< Q of weights and means fitted to the trial (demix::fit_to)
  double mean;       ///< Q of the mean of the other trials
};
struct LeftOutDrawer {
  std::array<std::vector<LeftOutTrial>, kActions> action;
  double quality_squared;  ///< Q2 of all actions, fitted, means removed as in-sample
};
/// Learns once for each recording.
LeftOutDrawer leave_recordings_out(const DrawerData& data);
/// Of drawer_data(); once per process.
const LeftOutDrawer& drawer_left_out();

/// The drawer jumps by `by_m` away from the walker, `at_s` after the start.
struct DrawerJump {
  double at_s, by_m;
};

/// A run with its measures.
struct DrawerRun {
  std::vector<SequenceState> states;  ///< all steps
  std::vector<double> front_W_m;      ///< the closed drawer's front, of all steps
  std::vector<PlannedAction> history;
  double final_distance_m = 0.0;
  double foot_speed_m_s = 0.0;     ///< largest speed of the lowest point of standing feet
  double joint_speed_rad_s = 0.0;  ///< largest speed of one axis-angle component

  double foot_correction_m = 0.0;  ///< rms of the larger of both feet's, against the mixture

  int count(Action action) const;
};
/// @throws std::runtime_error if there is no plan.
DrawerRun run_drawer(double distance_m, const std::vector<DrawerJump>& jumps = {});

}  // namespace mimesis::synthesizer
