#pragma once
#include "tools/mimesis/walk/study/implied.h"

namespace mimesis::walk {

enum class Feedback {
  kNone,   ///< set-points as they are
  kOwn,    ///< the walker's stabilizer around the reference that the angles imply
};

/// Plays angles on the plant until the robot falls or they end. Of the result: figures, fell_at_s,
/// dcm_max_m 0. Deterministic.
TrialResult play(const Robot& robot, const JointTrack& track, Feedback feedback,
                 const hw::sim::BodyOptions& body = {}, int delay_ticks = 1);

}  // namespace mimesis::walk
