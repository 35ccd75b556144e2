#pragma once
#include "experiments/walk/study/implied.h"
#include "experiments/walk/study/recording.h"

namespace mimesis::walk {

/// Parameters of the actions 1, 2, 3 for all joints: of a training trial, or for a goal.
using JointActions = std::array<synthesizer::MotionParameters, synthesizer::kActions>;
JointActions reconstructed(const synthesizer::LearnedActions& joints, std::size_t trial);
JointActions inferred(const synthesizer::LearnedActions& joints, const DrawerGoal& goal);

/// The naive approach [M18 3.8.4, table 3.1]: angles of all joints from their mixture, actions
/// joined by eq. 3.23. The start from standing, which was not learned, is that of `walk`: what the
/// pattern generator makes of the same goal; the mixture takes over in its second action, the
/// difference fading within half a step. Timing of steps as there, too.
JointTrack naive_track(const synthesizer::LearnedActions& joints, const JointActions& actions,
                       const Recording& walk);

/// The recorded angles themselves.
JointTrack track_of(const Recording& walk);

}  // namespace mimesis::walk
