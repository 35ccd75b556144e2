#pragma once
#include <vector>

#include "nodes/walker/tasks/cascade.h"
#include "nodes/walker/tasks/limits.h"
#include "nodes/walker/tasks/stack.h"

namespace mimesis::walker {

/// A task of the stack with the robot's indices instead of names.
struct Task {
  TaskKind kind = TaskKind::posture;
  int level = 0;  ///< 0 comes first; no gaps
  double weight = 1.0, gain_1_s = 20.0;
  int link = -1;
  int side = 0;                 ///< foot or hand
  std::vector<int> dofs = {};   ///< posture: joints
  std::vector<int> upper = {};  ///< per joint: index in Biped::upper_body, or −1
  std::vector<int> axes = {};   ///< axes that count, of 3 (foot: 6)
};

/// Tasks in the order of their priorities.
/// @throws ConfigError "stack.tasks: 'NAME': what, expected ..."
std::vector<Task> make_tasks(const robot::Biped& biped, const StackSettings& settings);

/// State of the robot from which the tasks' errors follow.
struct Posture {
  explicit Posture(const robot::RobotTree& tree)
      : q(Eigen::VectorXd::Zero(tree.dof())), kinematics(tree), dynamics(tree) {
    update();
  }
  void update() {
    kinematics.update(X_WB, q);
    com_W = kinematics.com();
  }
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  Eigen::VectorXd q;
  robot::Kinematics kinematics;
  robot::Dynamics dynamics;
  Eigen::Vector3d com_W;
};

/// Tasks as rows of a cascade: the goal of each for the end of the tick, rows of the Jacobian, and
/// errors.
class TaskRows {
 public:
  TaskRows(const robot::Biped& biped, std::vector<Task> tasks);

  int levels() const { return levels_; }
  int most_rows() const { return most_rows_; }
  void forget();  ///< forgets the last goals, so that the next ones are no jump

  /// Sets the goals of this tick from the robot's state and the wishes, with a height that the legs
  /// can give within the bounds `lower`, `upper` of the tick's displacements.
  void aim(const Posture& posture, const TaskGoals& goals, double dt_s,
           const Eigen::Ref<const Eigen::VectorXd>& lower,
           const Eigen::Ref<const Eigen::VectorXd>& upper);
  /// Part of the tick's height that the legs could not give [m].
  double missing_height_m() const { return leg_room_.missing_m(); }
  void fill(const Posture& posture, Cascade& cascade);
  /// b: error to the tick's goals, for the rows that fill() has added.
  void missing(const Posture& posture, Eigen::Ref<Eigen::VectorXd> b) const;
  int first_level_rows() const { return first_level_rows_; }

 private:
  /// Goal of a task at the end of the tick.
  struct Aim {
    Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
    Eigen::Matrix3d R_W = Eigen::Matrix3d::Identity();
    double strength = 1.0;  // factor on the weight
    bool used = true;
    Eigen::Vector3d before_p_W = Eigen::Vector3d::Zero();  // the wish of the last tick
  };
  void aim_at_com(const Task& task, Aim& aim, const Posture& posture, const TaskGoals& goals,
                  double dt_s, const Eigen::Ref<const Eigen::VectorXd>& lower,
                  const Eigen::Ref<const Eigen::VectorXd>& upper);
  void aim_at_foot(const Task& task, Aim& aim, const Posture& posture, const TaskGoals& goals,
                   double dt_s) const;
  void aim_at_hand(const Task& task, Aim& aim, const Posture& posture, const TaskGoals& goals,
                   double dt_s) const;
  void aim_at_position(const Task& task, Aim& aim, const Eigen::Vector3d& now,
                       const Eigen::Vector3d& goal, const Eigen::Vector3d& rate, double dt_s) const;
  void aim_at_rotation(const Task& task, Aim& aim, const Eigen::Matrix3d& now,
                       const Eigen::Matrix3d& goal, const Eigen::Vector3d& rate, double dt_s) const;
  void aim_at_posture(const Task& task, const Posture& posture, const TaskGoals& goals,
                      double dt_s);
  void fill_task(const Task& task, const Aim& aim, const Posture& posture, Cascade& cascade);

  const robot::Biped* biped_;
  LegRoom leg_room_;
  std::vector<Task> tasks_;
  std::vector<Aim> aims_;
  std::vector<double> joint_goal_;  // dof
  Eigen::Matrix3d R_before_;
  bool has_before_ = false;
  bool height_returns_ = false;  // the CoM returns to its height after legs were too short
  int levels_ = 0, most_rows_ = 0, used_ = 0, first_level_rows_ = 0;
  bool rest_is_last_ = false;  // the last level regularises and does nothing else
  robot::Jacobian jacobian_;
  Eigen::Matrix3Xd com_jacobian_;
};

}  // namespace mimesis::walker
