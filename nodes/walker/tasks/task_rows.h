#pragma once
#include <vector>

#include "nodes/walker/tasks/cascade.h"
#include "nodes/walker/tasks/leg_room.h"
#include "nodes/walker/tasks/task_list.h"

namespace mimesis::walker {

/// Where a robot is: what tasks are measured with.
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

/// Tasks as rows of a cascade: where each shall be at the end of the tick, the Jacobian's rows, and
/// what is missing.
class TaskRows {
 public:
  TaskRows(const robot::Biped& biped, std::vector<Task> tasks);

  int levels() const { return levels_; }
  int most_rows() const { return most_rows_; }
  void forget();  ///< the goals before: a jump is none

  /// From where the robot is, and what is wished: the tick's own goals, with a height that the legs
  /// can give within the bounds of the tick's displacements. `dt` in s.
  void aim(const Posture& posture, const TaskGoals& goals, double dt_s,
           const Eigen::Ref<const Eigen::VectorXd>& lower,
           const Eigen::Ref<const Eigen::VectorXd>& upper);
  /// What the legs could not give of the tick's height [m].
  double missing_height_m() const { return leg_room_.missing_m(); }
  void fill(const Posture& posture, Cascade& cascade);
  /// b: what is missing to the tick's goals, of the rows that were filled in.
  void missing(const Posture& posture, Eigen::Ref<Eigen::VectorXd> b) const;
  int first_level_rows() const { return first_level_rows_; }

 private:
  /// Goal of a task at the end of the tick.
  struct Aim {
    Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
    Eigen::Matrix3d R_W = Eigen::Matrix3d::Identity();
    double strength = 1.0;  // times the weight
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
  bool height_returns_ = false;  // to the goal, from where legs were too short
  int levels_ = 0, most_rows_ = 0, used_ = 0, first_level_rows_ = 0;
  bool rest_is_last_ = false;  // the last level regularises and does nothing else
  robot::Jacobian jacobian_;
  Eigen::Matrix3Xd com_jacobian_;
};

}  // namespace mimesis::walker
