#pragma once
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

/// What was decided.
struct Task {
  Grip grip = Grip::precision;
  Transport transport = Transport::above;
  std::string goal = "high";  ///< name of a kin::GoalPlace
};

struct TaskSettings {
  RoadmapSettings roadmap;
  SearchSettings search;
  double margin_m = 0.002;   ///< least distance of all safety balls [m]
  double approach_m = 0.09;  ///< straight way to and from the object [m]
  double lift_m = 0.05;      ///< straight up after the grasp, straight down before the release [m]
  double precision_depth_m =
      0.02;                  ///< the object's top above the grasp centre in a precision grip [m]
  int ik_attempts = 60;      ///< starts of the inverse kinematics per hand goal [1]
  int reaching_starts = 10;  ///< postures from which reaches to each target sample the roadmap [1]
  int reaching_postures = 15;  ///< samples of each [1]
  double preference =
      0.5;  ///< link cost where the hand passes the bridge as decided; 1: no preference [1]
  double corner_rad = 0.15;    ///< largest rounding of corners [rad]
  double speed = 0.6;          ///< share of the model's velocity and acceleration limits in use [1]
  double contact_speed = 0.3;  ///< the same for straight motions to and from contact [1]
  double period_s = 0.005;     ///< of the trajectories [s]
};

enum class Phase { reach, approach, grasp, transport, release, retreat };

struct PlannedMotion {
  Phase phase = Phase::reach;
  std::vector<Eigen::MatrixXd> curves;  ///< the path: Bézier control points (see SmoothPath) [rad]
  Obstacles obstacles;                  ///< what `curves` are certified against
  JointTrajectory trajectory;
};

/// All motions of the task, complete before the first one starts. The hand closes after the
/// approach and opens before the retreat.
struct TaskPlan {
  std::vector<PlannedMotion> motions;
  double path_length_rad = 0.0;
  int roadmap_nodes = 0;
};

/// The off-line part: samples the whole joint space and the reaches to object and goals, refines
/// against the table's obstacles.
Roadmap prepare_roadmap(const kin::ArmModel& arm, const kin::Table& table,
                        const TaskSettings& settings);

/// Plans reach, straight approach, lift, transport, straight lowering and retreat from posture
/// `start`. Pure: the same arguments give the same bits. Failure: a reason in words.
tl::expected<TaskPlan, Status> plan_task(const kin::ArmModel& arm, const kin::Table& table,
                                         const Roadmap& roadmap, const Eigen::VectorXd& start,
                                         const Task& task, const TaskSettings& settings);

}  // namespace mimesis::planner
