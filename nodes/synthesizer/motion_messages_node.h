#pragma once
#include <span>
#include <string>
#include <vector>

#include "nodes/synthesizer/walkers.h"
#include "proto/motion.pb.h"

namespace mimesis::synthesizer {

/// Why a message cannot be obeyed, for log lines and MotionStatus.reason; empty if it can.
std::string fault(const v1::MotionGoal& goal, const Walkers& walkers);
std::string fault(const v1::StyleWish& wish, const Walkers& walkers);
std::string fault(const v1::Beat& beat);
std::string fault(const v1::GaitCommand& gait, const Walkers& walkers);

/// Shares of all styles of the repertoire, sum 1. The wish has no fault.
std::vector<double> to_shares(const v1::StyleWish& wish, const Repertoire& repertoire);
GaitWish to_gait(const v1::GaitCommand& gait);

/// The motion of one. `velocity_rad_s`: as many as angles.
void to_proto(const Walkers& walkers, int i, std::span<const double> velocity_rad_s,
              v1::Motion& motion);
/// All of them. The lists keep their memory from message to message.
void to_proto(const Walkers& walkers, v1::MotionBatch& batch);
/// "stand", "start", "walk" or "stop".
const char* action_name(StepCourse::Stage stage);
v1::MotionGoalKind to_proto(WalkTask task);

}  // namespace mimesis::synthesizer
