#pragma once
#include <memory>
#include <string>
#include <vector>

#include "common/robot/dynamics.h"
#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

enum class TaskKind { com, foot, orientation, position, posture, regularisation };

/// One task of a stack, as in a YAML file.
struct TaskSpec {
  std::string name;  ///< "left foot"
  TaskKind kind = TaskKind::posture;
  int priority = 1;        ///< 1 comes first; equal ones share a level
  double weight = 1.0;     ///< within the level
  double gain_1_s = 20.0;  ///< gain of the error; from 1/dt on all of it at every tick
  std::string link = {};   ///< foot: a sole, orientation: any, position: a hand
  /// posture; empty: the upper body. Legs go to half-sitting.
  std::vector<std::string> joints = {};
  /// Axes x y z in W that count; empty: all. A foot also takes 6, position then rotation; with 3
  /// all rotations count.
  std::vector<bool> axes = {};
};

struct StackSettings {
  std::vector<TaskSpec> tasks;      ///< by priority; see TaskSpec
  double damping = 1e-3;            ///< damping of singular directions [1]
  double knee_margin_rad = 0.02;    ///< kept from the stretched leg
  double limit_margin_rad = 0.005;  ///< kept from the joints' limits
  double speed_share = 0.98;        ///< used share of the joints' speed limits [1]
};

/// Goals at the end of one tick.
struct TaskGoals {
  Eigen::Vector3d com_W_m, com_v_W;  ///< [m], [m/s]
  std::array<FootState, 2> foot;     ///< left, right
  Eigen::Matrix3d R_W_trunk;         ///< goal of every orientation task
  Eigen::VectorXd upper_body;        ///< Biped::upper_body order [rad]
  Eigen::VectorXd upper_body_rate;   ///< [rad/s]; empty: 0
  struct Hand {
    Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();  ///< origin of the link Biped::hand
    /// 0: no goal; 1: full weight, the posture gives way until micrometres are left. Continuous.
    double share = 0.0;
  };
  std::array<Hand, 2> hand;
};

struct StackState {
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  Eigen::VectorXd q, dq;                         ///< dof [rad], [rad/s], within the limits
  double com_error_m = 0.0, foot_error_m = 0.0;  ///< distance from the goals; the worse foot
  bool limited = false;  ///< a limit keeps a task of the first level from its goal
  std::string reason;    ///< empty, or why the last solve failed; q then stays
};

/// Generalised inverse kinematics: strict priorities with joint limits as inequalities on top
/// [M18 3.8.1; Mansard 2009; Escande, Mansard, Wieber 2014]. Joints slow down before a limit and
/// return from beyond it with a time constant of 20 ms. Distant goals are approached in bounded
/// steps.
class Stack {
 public:
  /// Starts half-sitting. The biped outlives it.
  /// @throws ConfigError for unknown links or joints, or values that contradict each other
  Stack(const robot::Biped& biped, const StackSettings& settings);
  ~Stack();
  void reset(const Eigen::Isometry3d& X_WB, const Eigen::Ref<const Eigen::VectorXd>& q);
  /// Advances by one tick of dt [s]. No allocation.
  const StackState& step(const TaskGoals& goals, double dt_s);
  const StackState& state() const { return state_; }

 private:
  struct Parts;
  const char* fault(const TaskGoals& goals, double dt_s) const;
  bool move(const TaskGoals& goals, double dt_s);
  void ease(double dt_s);
  void advance();
  void measure(const TaskGoals& goals);

  std::unique_ptr<Parts> parts_;
  StackState state_;
};

/// Default stack: feet and CoM, then trunk, then hands and upper body, then regularisation.
StackSettings walking_stack(const robot::Biped& biped);

}  // namespace mimesis::walker
