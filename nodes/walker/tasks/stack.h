#pragma once
#include <span>
#include <string>
#include <vector>

#include "common/robot/dynamics.h"
#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

enum class TaskKind { kCom, kFoot, kOrientation, kPosition, kPosture, kRegularisation };

/// One task of a stack, as a YAML file says it.
struct TaskSpec {
  std::string name;  ///< "left foot"
  TaskKind kind = TaskKind::kPosture;
  int priority = 1;                 ///< 1 comes first; equal ones share a level
  double weight = 1.0;              ///< within the level
  double gain_1_s = 20.0;           ///< of the error
  std::string link;                 ///< kFoot, kOrientation, kPosition
  std::vector<std::string> joints;  ///< kPosture; empty: the upper body
  std::vector<bool> axes;           ///< of x y z that count; empty: all
};

struct StackSettings {
  std::vector<TaskSpec> tasks;
  double damping = 1e-3;          ///< of singular directions [1]
  double knee_margin_rad = 0.02;  ///< from the stretched leg
  double limit_margin_rad = 0.005;
  double speed_share = 0.98;  ///< of the joints' speed limits that may be used
};

/// Wishes at one tick. Names as in the specs.
struct TaskGoals {
  Eigen::Vector3d com_W_m, com_v_W;
  std::array<FootState, 2> foot;
  Eigen::Matrix3d R_W_trunk;
  Eigen::VectorXd upper_body;  ///< Biped::upper_body order [rad]
  Eigen::VectorXd upper_body_rate;
  struct Hand {
    Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
    double share = 0.0;  ///< 0: no wish; 1: wholly
  };
  std::array<Hand, 2> hand;
};

struct StackState {
  Eigen::Isometry3d X_WB;
  Eigen::VectorXd q, dq;  ///< within the limits
  double com_error_m = 0.0, foot_error_m = 0.0;
  bool limited = false;  ///< a limit keeps a task of the first level from its goal
  std::string reason;    ///< empty, or why the last solve failed: q stays
};

/// Generalised inverse kinematics: strict priorities with joint limits as inequalities on top
/// [M18 3.8.1; Mansard 2009; Escande, Mansard, Wieber 2014].
class Stack {
 public:
  /// @throws ConfigError for links and joints that the robot has not
  Stack(const robot::Biped& biped, StackSettings settings);
  void reset(const Eigen::Isometry3d& X_WB, const Eigen::Ref<const Eigen::VectorXd>& q);
  const StackState& step(const TaskGoals& goals, double dt_s);  ///< no allocation
};

/// Feet and CoM, then trunk, then hands and upper body, then regularisation.
StackSettings walking_stack(const robot::Biped& biped);

}  // namespace mimesis::walker
