#pragma once
#include <optional>

#include "nodes/planner/task_sequence.h"
#include "proto/arm.pb.h"
#include "proto/cognition.pb.h"
#include "proto/planner.pb.h"

namespace mimesis::planner {

/// Messages <-> the planner's own types. Nothing: not settled, or a part of the decision is
/// unknown.
std::optional<DecidedTask> to_decided(const v1::Decision& decision);
/// Nothing if the number of joints is not `dof`.
std::optional<ArmReading> to_reading(const v1::ArmState& state, int dof);
HandReading to_reading(const v1::HandState& state);

v1::Grip to_proto(Grip grip);
v1::TaskState to_proto(TaskSequence::State state);
v1::TaskPhase to_proto(Phase phase);
/// Without header.
v1::TaskStatus to_status(const TaskSequence& sequence);
v1::Trajectory to_proto(const PlannedMotion& motion);

}  // namespace mimesis::planner
