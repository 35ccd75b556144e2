#pragma once
#include "common/motion/mocap/trials.h"

namespace mimesis::synthesizer {

/// A rotation has two axis-angle vectors, θw and (θ − 2π)w. Within a trajectory jumps between
/// them are removed when it is read [M18 3.3.2]; here the trials of a set are brought to the same
/// branch, joint by joint, for where one trial has +3.1 rad about an axis and another −3.1 rad the
/// mean of the two is no posture between them. To do before anything is learned that will be
/// blended. Per joint (rows "name.x", "name.y", "name.z" in sequence; others stay) each trial is
/// moved to the branch nearest to that trial around which all lie closest together.
/// Returns how many joint trajectories changed. O(trials²·joints).
int align_rotation_branches(mocap::Trials& trials);

}  // namespace mimesis::synthesizer
