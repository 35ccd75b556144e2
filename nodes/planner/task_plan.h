#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "common/kin/arm.h"
#include "common/kin/table.h"
#include "nodes/planner/grasp.h"
#include "nodes/planner/path_search.h"
#include "nodes/planner/roadmap.h"
#include "nodes/planner/time_scaling.h"

namespace mimesis::planner {

/// The decisions to be planned for.
struct Task {
  Grip grip = Grip::precision;
  Transport transport = Transport::above;
  std::string goal = "high";  ///< name of a kin::GoalPlace
  /// Postures of motions that F5 names [M18 2.3.2], from the object to the goal: holds are sought
  /// near the first and the last, links near all are cheap; if that gives no plan, none is
  /// pre-selected. Empty: none.
  std::vector<Eigen::VectorXd> preselected{};
};

struct TaskSettings {
  RoadmapSettings roadmap;
  SearchSettings search;
  double margin_m = 0.002;  ///< least distance of all safety balls [m]
  /// the same where there is room: tried first, for what is not where it is seen [m]
  double wide_margin_m = 0.01;
  double approach_m = 0.09;  ///< straight way to and from the object [m]
  double lift_m = 0.05;      ///< straight up after the grasp, straight down before the release [m]
  double precision_depth_m =
      0.02;  ///< the object's top above the grasp centre in a precision grip [m]
  /// the hand may lean so far where it cannot reach, or not straight, as the grip says [rad]
  double lean_rad = 0.15;
  int ik_attempts = 60;      ///< starts of the inverse kinematics per hand goal [1]
  int reaching_starts = 10;  ///< postures from which reaches to each target sample the roadmap [1]
  int reaching_postures = 15;  ///< samples of each [1]
  double preference = 0.5;     ///< link cost where the hand passes the bar as decided, and near
                               ///< what is pre-selected; 1: no preference [1]
  double corner_rad = 0.15;    ///< largest rounding of corners [rad]
  double speed = 0.6;          ///< share of the model's velocity and acceleration limits in use [1]
  double contact_speed = 0.3;  ///< share of the limits for straight motions to and from contact [1]
  double period_s = 0.005;     ///< period of the trajectories [s]
  /// Deadline or cancellation of all that these settings are for. Once it has said yes, plans fail
  /// with its reason, and roadmaps are of no use.
  Interrupt interrupt{};
};

enum class Phase { reach, approach, grasp, transport, release, retreat };

struct PlannedMotion {
  Phase phase = Phase::reach;
  std::vector<Eigen::MatrixXd> curves;  ///< the path: Bézier control points (see SmoothPath) [rad]
  Obstacles obstacles;                  ///< obstacles that `curves` are certified against
  JointTrajectory trajectory;
  double length_rad = 0.0;  ///< of the path
  double margin_m = 0.0;    ///< of the certificate of `curves` [m]
  FoundBy found_by = FoundBy::line;
};

/// To keep a deadline, look at the clock once in so many calls of an Interrupt [1], and end so much
/// earlier [s]: the work between two calls and the return take that long.
inline constexpr std::uint64_t kQuestionsPerLook = 4;
inline constexpr double kLongestPart_s = 5e-4;

/// Stops that leave the path keep this share of the margin [1].
inline constexpr double kStopMargin = 0.5;
/// In this time after the last set-point drives may begin to stop by themselves [s].
double stop_delay_s(const kin::ArmModel& arm, double period_s);
/// A drive may stand or slow down so long before the others do: two SYNCs that it leaves
/// unanswered, the cycle in which the bridge learns it, and the one in which the others hear of it
/// [s].
inline double stop_alone_s(double period_s) { return 4.0 * period_s; }

/// The motion through `waypoints`, whose lines are certified: corners rounded, timed within `speed`
/// (share of the model's limits) so that it can be stopped everywhere. Empty if it cannot, however
/// slow it is, or if interrupted.
/// @param waypoints  at least two that differ
/// @param margin_m   of the path; settings.margin_m if that is more [m]
/// @param corners    what rounded corners have to meet beside; empty: nothing
std::optional<PlannedMotion> timed_motion(const kin::ArmModel& arm, Phase phase,
                                          const std::vector<Eigen::VectorXd>& waypoints,
                                          const Obstacles& obstacles, double speed,
                                          const TaskSettings& settings, double margin_m = 0.0,
                                          const SmoothPath::Accept& corners = {});

/// All motions of the task, complete before the first one starts. The hand closes after the
/// approach and opens before the retreat.
struct TaskPlan {
  std::vector<PlannedMotion> motions;
  double path_length_rad = 0.0;
  int roadmap_nodes = 0;
  std::vector<std::size_t> passed{};  ///< of a move, before each motion: places of its way
};

/// `count` postures, evenly along the way from above the object to above the goal.
std::vector<Eigen::VectorXd> carried_postures(const TaskPlan& plan, int count);

/// The off-line part: samples the whole joint space and the reaches to object and goals, refines
/// against the table's obstacles.
Roadmap prepare_roadmap(const kin::ArmModel& arm, const kin::Table& table,
                        const TaskSettings& settings);

/// A roadmap for a table that has changed. `known`, while fewer of its nodes are inhibited than the
/// refinement leaves anyway: noise of a scene changes nothing. Else its inhibited nodes move out of
/// the obstacles, the others stay. If interrupted `known`, too.
std::shared_ptr<const Roadmap> refreshed_roadmap(std::shared_ptr<const Roadmap> known,
                                                 const kin::ArmModel& arm, const kin::Table& table,
                                                 const TaskSettings& settings);

/// Plans reach, straight approach, lift, transport, straight lowering and retreat from posture
/// `start`. Pure: the same arguments give the same bits. Failure: a reason in words.
tl::expected<TaskPlan, Status> plan_task(const kin::ArmModel& arm, const kin::Table& table,
                                         const Roadmap& roadmap, const Eigen::VectorXd& start,
                                         const Task& task, const TaskSettings& settings);

/// Balls and boxes of `now` that are new, or farther than `tolerance_m` from where `planned` has
/// them. What is gone is in nobody's way.
Obstacles moved_obstacles(const kin::Table& planned, const kin::Table& now, double tolerance_m);

/// The motions from the `first` on keep clear of these balls and boxes, too; certified. While the
/// object is lifted or lowered it may stand on a moved box, but not enter it. `table`: the object's
/// size.
bool keeps_clear(const kin::ArmModel& arm, const kin::Table& table, const TaskPlan& plan,
                 std::size_t first, const Obstacles& moved, double margin_m);

}  // namespace mimesis::planner
