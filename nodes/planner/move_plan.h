#pragma once
#include <string>
#include <variant>
#include <vector>

#include "nodes/planner/task_plan.h"
#include "nodes/planner/tool_path.h"

namespace mimesis::planner {

/// A posture, or a place of the hand with any orientation.
struct Place {
  Eigen::VectorXd q{};                  ///< n [rad]; empty: the hand's place counts
  Eigen::Vector3d hand{0.0, 0.0, 0.0};  ///< in W [m]
};

/// A motion without a task.
struct Move {
  std::vector<Place> via{};    ///< where it rests on its way, in this order
  std::vector<Place> goals{};  ///< where it ends: at one of them
  /// Instead of places: the way of the tool, without a halt but where a corner is sharper than the
  /// tolerance.
  std::vector<ToolPiece> tool{};
  ToolTolerance tolerance{};
};

/// A planning problem.
struct PlanRequest {
  kin::Table table;
  Eigen::VectorXd start;  ///< [rad]
  std::variant<Task, Move> what;
  std::vector<kin::Ball> held{};  ///< covers an object in the hand, centres in E; empty: none
};

/// Motions of phase `reach` from `start` through all places of the move, one for each leg; none if
/// the arm is there. Where several postures fit a place, others are tried if the rest of the way
/// fails. Of a tool's way one motion. The table's object is an obstacle, or carried if it is held.
/// An arm that stands where it touches the object leaves it straight back first; an object in its
/// hand that stands on a box is lifted first. `roadmap` may be empty.
tl::expected<TaskPlan, Status> plan_move(const kin::ArmModel& arm, const Roadmap& roadmap,
                                         const PlanRequest& request, const TaskSettings& settings);

/// A start may be this far beyond a limit, as an encoder at an end stop says: it is planned from
/// the limit [rad, m].
inline constexpr double kAtLimit = 1e-3;

/// Why no motion of the arm can start or end at `q`: "joint 2 at 3.2 rad, expected -3.1 .. 3.1";
/// empty if one can. Endless joints may be anywhere.
std::string beyond_limits(const kin::ArmModel& arm, const Eigen::VectorXd& q, double tolerance);

/// Plans a task or a move. Endless joints go the shortest way that is free; one that starts beyond
/// its range of ±2π is planned as if it were within, by whole turns.
tl::expected<TaskPlan, Status> plan_request(const kin::ArmModel& arm, const Roadmap& roadmap,
                                            const PlanRequest& request,
                                            const TaskSettings& settings);

}  // namespace mimesis::planner
