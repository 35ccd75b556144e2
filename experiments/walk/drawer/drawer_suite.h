#pragma once
#include "experiments/walk/drawer/drawer_trial.h"
#include "experiments/walk/trial/suites.h"

namespace mimesis::walk {

/// Thirty drawer tasks at random: fronts 1.2 to 2.8 m away and up to 0.06 rad aside, objects 0.124
/// to 0.273 m deep [M18 3.8.4]; ten drawers stay, ten jump by up to 10 cm either way while the
/// robot is on its way, ten when it is about to stand before it or reaches for it.
/// @param robot, actions  outlive the trials
std::vector<DrawerTrialSpec> drawers30(const Robot& robot, const synthesizer::BipedDrawer& actions,
                                       const SuiteOptions& options);

/// What became of a task.
enum class DrawerEnd {
  kTaken,
  kRefused,  ///< stands and says why
  kFell,
  kSilent,  ///< not taken, and nobody says why
};
DrawerEnd end_of(const DrawerResult& result);

/// All of them on `jobs` threads, as run_trials().
void run_drawer_trials(std::span<const DrawerTrialSpec> trials, int jobs,
                       const std::function<void(const DrawerResult&)>& done);

}  // namespace mimesis::walk
