#pragma once
#include <optional>
#include <vector>

#include "common/kin/arm.h"
#include "common/kin/ik.h"

namespace mimesis::planner {

/// Joint path along which the hand moves on the straight line from where it is at `start` to
/// `goal`, a posture every `step_m`, with goal.axes kept all the way. Each posture is the inverse
/// kinematics from the one before. Nothing if there is a joint limit or a singularity in the way.
/// Knows nothing of obstacles.
std::optional<std::vector<Eigen::VectorXd>> straight_way(const kin::ArmModel& arm,
                                                         const Eigen::VectorXd& start,
                                                         const kin::IkGoal& goal, double step_m);

/// Postures by which inverse kinematics moves the hand from `start` to `goal` in `count` even steps
/// on the straight line, orientation free until the last: they sample the roadmap where hands go
/// when they reach [M18 2.3.2]. Stops short where it does not converge.
std::vector<Eigen::VectorXd> reaching_postures(const kin::ArmModel& arm,
                                               const Eigen::VectorXd& start,
                                               const kin::IkGoal& goal, int count);

}  // namespace mimesis::planner
