#pragma once
#include "nodes/synthesizer/robot/biped_sequence.h"
#include "experiments/walk/trial/trial.h"

namespace mimesis::walk {

/// What a sequence of actions 1, 1, 2, 3 from standing has to do [M18 3.8.4].
struct DrawerGoal {
  double normal_m = 0.533, reaching_m = 0.261;  ///< travels of the middle of the feet
  double final_distance_m = 0.51;               ///< of the middle of the feet to the closed front
  double object_depth_m = 0.2, object_lateral_m = 0.0;
  bool operator==(const DrawerGoal&) const = default;

  double front_m() const { return 1.75 * normal_m + reaching_m + final_distance_m; }
  double reach_m() const { return final_distance_m + object_depth_m; }
  synthesizer::ActionTask task() const;
};
/// Of a training trial.
DrawerGoal goal_of(const synthesizer::DrawerData& data, std::size_t trial);

/// Rows of the three actions (upper-body joints, then kVelocityRows), rows × samples.
using ActionRows = std::array<Eigen::MatrixXd, synthesizer::kActions>;
/// Those of a training trial.
ActionRows rows_of(const synthesizer::DrawerData& data, std::size_t trial);

/// Skeleton that rows belong to, and the furniture.
struct ScriptRobot {
  explicit ScriptRobot(const Robot& robot);
  const Robot* robot;
  retarget::RobotFigure figure;
  robot::RobotTree upper;
  std::vector<Eigen::Index> joint;  ///< of `upper`, for each of Biped::upper_body
  synthesizer::Drawer drawer;
  double pelvis_height_m;
};

inline constexpr double kStep_s = 0.8, kStanding_s = 2.4, kBegin_s = 1.0;
inline constexpr double kArrives = 0.95;  ///< right hand at the object: share of action 3
inline constexpr double kHolds_s = 1.0;   ///< after action 3
inline constexpr double kScript_s = kBegin_s + kStep_s + 6 * kStep_s + kStanding_s + kHolds_s;

/// Actions 1, 1, 2, 3 of given rows as a walker's wishes, without a synthesizer: the first action
/// is action 1 from standing (one and a half steps long). Feet land where `goal` has them; in
/// action 3 the hands are where the joints have them from a pelvis above the feet, plus what is
/// left to handle and object, growing in [M18 eq. 3.12].
class Script {
 public:
  Script(const ScriptRobot& robot, ActionRows rows, const DrawerGoal& goal);

  /// `plan`: the walker's last one; null before the first.
  const walker::WalkerWish& step(const walker::PatternSample* plan);
  /// 0 to 3; −1 before the first action.
  int number() const { return number_; }
  double phase() const { return phase_; }  ///< share of it, [0, 1)
  Eigen::Vector3d object_W_m() const { return target_W_m_[robot::kRight]; }  ///< drawn out

 private:
  void find_phase(const walker::PatternSample* plan);
  void move_upper_body();
  void wish_feet(const walker::PatternSample& plan);
  void wish_hands();
  Eigen::Vector3d hand_W_m(robot::Side side, double phase);

  const ScriptRobot* robot_;
  ActionRows rows_;
  double feet_distance_m_;
  std::array<double, 6> landing_m_;  ///< x of the steps, right foot first
  int number_ = -1, steps_ = 0;
  double time_s_ = 0.0, phase_ = 0.0, stood_s_ = 0.0, since_s_ = 0.0;
  robot::Kinematics kinematics_;
  std::array<Eigen::Vector3d, 2> target_W_m_, left_over_m_;
  Eigen::VectorXd q_, dq_, aim_, aim_rate_, offset_, offset_rate_;
  walker::WalkerWish wish_;
};

/// Row values at phase [0, 1], linear between samples.
Eigen::VectorXd at_phase(const Eigen::MatrixXd& rows, double phase);

}  // namespace mimesis::walk
