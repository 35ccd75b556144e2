#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "common/interrupt.h"
#include "common/kin/arm.h"
#include "common/kin/table.h"
#include "common/task/symbols.h"

namespace mimesis::planner {

using task::Goal, task::Grip, task::Transport;

/// Joint path along which the hand moves on the straight line from where it is at `start` to
/// `goal`, a posture every `step_m`, with goal.axes kept all the way. Each posture is the inverse
/// kinematics from the one before. Empty if there is a joint limit or a singularity in the way.
/// Ignores obstacles.
std::optional<std::vector<Eigen::VectorXd>> straight_way(const kin::ArmModel& arm,
                                                         const Eigen::VectorXd& start,
                                                         const kin::IkGoal& goal, double step_m,
                                                         const Interrupt& interrupt = {});

/// Postures by which inverse kinematics moves the hand from `start` to `goal` in `count` even steps
/// on the straight line, orientation free until the last: they sample the roadmap where hands go
/// when they reach [M18 2.3.2]. Stops short where it does not converge.
std::vector<Eigen::VectorXd> reaching_postures(const kin::ArmModel& arm,
                                               const Eigen::VectorXd& start,
                                               const kin::IkGoal& goal, int count,
                                               const Interrupt& interrupt = {});

/// Goals of the hand that hold a cylinder whose centre is at `center`: precision: z_E down, the
/// object's top `depth_m` above E; full: E at the centre, y_E up or down, so that the fingers close
/// horizontally. The turn about the vertical stays free, as the cylinder looks the same from all
/// sides.
/// @param lean  turns the hand against the cylinder, so that it leans [rad, in E]
std::vector<kin::IkGoal> grasp_goals(Grip grip, const Eigen::Vector3d& center, double height_m,
                                     double depth_m,
                                     const Eigen::Vector3d& lean = Eigen::Vector3d::Zero());

/// How the hand may lean with this grip: not at all, then half and all of `most_rad` to each side
/// [rad, in E].
std::vector<Eigen::Vector3d> leans(Grip grip, double most_rad);

/// A goal with the hand orientation of posture q, at another place.
kin::IkGoal moved_hand(const kin::ArmModel& arm, const Eigen::VectorXd& q,
                       const Eigen::Vector3d& by_W);

/// Balls that cover an upright cylinder completely: n = ⌈h/r⌉ on its axis, radius √(r² + (h/2n)²).
std::vector<kin::Ball> cylinder_balls(const Eigen::Vector3d& center, double radius_m,
                                      double height_m);

/// Which ball or box of the table an upright cylinder at `center` would be in, in words; standing
/// on a box is allowed. Empty if its place is free.
std::optional<std::string> place_blocked(const kin::Table& table, const Eigen::Vector3d& center);

/// Boxes that close the plane of the bar except for the decided passage: `above` leaves the
/// space above the bar open, `below` the opening under it. They are the pre-selection P_F5 [M18
/// 2.3.2]: a posture is pre-selected if no safety ball enters them, so that P_F5 ∩ P_free is the
/// set of postures that are free of real and of closed space, and the certificate of motions covers
/// both.
std::vector<kin::Box> closed_passages(const kin::Table& table, Transport transport);

}  // namespace mimesis::planner
