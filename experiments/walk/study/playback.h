#pragma once
#include "experiments/walk/study/implied.h"

namespace mimesis::walk {

enum class Feedback {
  kNone,  ///< set-points as they are
  kOwn,   ///< the walker's stabilizer around the reference that the angles imply
};

/// Plays angles on the springs plant until the robot falls or they end, with the delays and gains
/// of launched_walker(). Of the result: figures and fell_at_s. Deterministic.
TrialResult play(const Robot& robot, const JointTrack& track, Feedback feedback);

}  // namespace mimesis::walk
