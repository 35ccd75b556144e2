#pragma once
#include "common/motion/demix/mixture.h"
#include "common/motion/model/motion_model.h"

namespace mimesis::synthesizer {

/// The model of a mixture over a set: one pattern a trial. Name and provenance stay empty.
/// @param tied  the mixture has one delay per row of a trial and source
/// @throws ConfigError if the mixture is not one over the set
MotionModel make_model(const mocap::Trials& set, const demix::Mixture& mixture, bool tied,
                       const mocap::Body& body);

/// One pattern a style, in order of first appearance: the mean over its patterns, of duration, step
/// length, turn and task too; clip and frames are those of the first.
/// @throws ConfigError if the model's delays are not tied: free ones have no mean
MotionModel average_styles(const MotionModel& model);

}  // namespace mimesis::synthesizer
