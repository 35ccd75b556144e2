#pragma once
#include <Eigen/Core>
#include <functional>

#include "common/kin/arm.h"

namespace mimesis::planner::peer {

/// OMPL's RRTConnect with its own defaults, motions looked at every 1/32 rad.
/// @param free  of a posture
bool rrt_connect_solves(const kin::ArmModel& arm,
                        const std::function<bool(const Eigen::VectorXd&)>& free,
                        const Eigen::VectorXd& start, const Eigen::VectorXd& goal, double most_s);

}  // namespace mimesis::planner::peer
