#include "nodes/planner/task_messages_node.h"

#include <cmath>

namespace mimesis::planner {

std::optional<DecidedTask> to_decided(const v1::Decision& decision) {
  if (!decision.settled() || decision.grip() == v1::GRIP_UNSPECIFIED ||
      decision.transport() == v1::TRANSPORT_UNSPECIFIED ||
      decision.goal() == v1::GOAL_UNSPECIFIED) {
    return std::nullopt;
  }
  return DecidedTask{
      {decision.grip() == v1::GRIP_PRECISION ? Grip::precision : Grip::full,
       decision.transport() == v1::TRANSPORT_ABOVE ? Transport::above : Transport::below,
       decision.goal() == v1::GOAL_HIGH ? "high" : "low"},
      decision.decided_ns() + 1};  // 0 stands for no decision
}

std::optional<ArmReading> to_reading(const v1::ArmState& state, int dof) {
  if (state.position_rad_size() != dof) return std::nullopt;
  return ArmReading{Eigen::VectorXd::Map(state.position_rad().data(), dof), state.operational(),
                    state.fault()};
}

HandReading to_reading(const v1::HandState& state) {
  return {state.closure(), state.moving(), state.object_detected(), state.active(), state.fault()};
}

v1::Grip to_proto(Grip grip) {
  return grip == Grip::precision ? v1::GRIP_PRECISION : v1::GRIP_FULL;
}

v1::TaskState to_proto(TaskSequence::State state) {
  switch (state) {
    case TaskSequence::State::idle:
      return v1::TASK_STATE_IDLE;
    case TaskSequence::State::planning:
      return v1::TASK_STATE_PLANNING;
    case TaskSequence::State::executing:
      return v1::TASK_STATE_EXECUTING;
    case TaskSequence::State::done:
      return v1::TASK_STATE_DONE;
    case TaskSequence::State::failed:
      return v1::TASK_STATE_FAILED;
  }
  return v1::TASK_STATE_UNSPECIFIED;
}

v1::TaskPhase to_proto(Phase phase) {
  switch (phase) {
    case Phase::reach:
      return v1::TASK_PHASE_REACH;
    case Phase::approach:
      return v1::TASK_PHASE_APPROACH;
    case Phase::grasp:
      return v1::TASK_PHASE_GRASP;
    case Phase::transport:
      return v1::TASK_PHASE_TRANSPORT;
    case Phase::release:
      return v1::TASK_PHASE_RELEASE;
    case Phase::retreat:
      return v1::TASK_PHASE_RETREAT;
  }
  return v1::TASK_PHASE_UNSPECIFIED;
}

v1::TaskStatus to_status(const TaskSequence& sequence) {
  v1::TaskStatus status;
  status.set_state(to_proto(sequence.state()));
  if (sequence.state() == TaskSequence::State::executing)
    status.set_phase(to_proto(sequence.phase()));
  if (const auto& task = sequence.task()) {
    status.set_grip(to_proto(task->grip));
    status.set_transport(task->transport == Transport::above ? v1::TRANSPORT_ABOVE
                                                             : v1::TRANSPORT_BELOW);
    status.set_goal(task->goal == "high" ? v1::GOAL_HIGH : v1::GOAL_LOW);
  }
  status.set_reason(sequence.reason());
  status.set_plan_succeeded(sequence.plan_succeeded());
  if (const auto& plan = sequence.plan()) {
    status.set_path_length_rad(plan->path_length_rad);
    status.set_roadmap_nodes(static_cast<std::uint32_t>(plan->roadmap_nodes));
  }
  return status;
}

v1::Trajectory to_proto(const PlannedMotion& motion) {
  v1::Trajectory trajectory;
  trajectory.set_phase(to_proto(motion.phase));
  const JointTrajectory& samples = motion.trajectory;
  for (Eigen::Index k = 0; k < samples.samples(); ++k) {
    v1::TrajectoryPoint& point = *trajectory.add_points();
    point.set_time_from_start_ns(
        static_cast<std::uint64_t>(std::llround(static_cast<double>(k) * samples.period_s * 1e9)));
    for (Eigen::Index j = 0; j < samples.position.rows(); ++j) {
      point.add_position_rad(samples.position(j, k));
      point.add_velocity_rad_s(samples.velocity(j, k));
    }
  }
  return trajectory;
}

}  // namespace mimesis::planner
