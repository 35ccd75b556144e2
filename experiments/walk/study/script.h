#pragma once
#include <optional>

#include "experiments/walk/trial/trial.h"
#include "nodes/synthesizer/robot/biped_sequence.h"

namespace mimesis::walk {

/// Goal of a sequence of actions 1, 1, 2, 3 from standing [M18 3.8.4].
struct DrawerGoal {
  double normal_m = 0.533, reaching_m = 0.261;  ///< travels of the middle of the feet
  /// distance from the middle of the feet to the closed front
  double final_distance_m = 0.51;
  double object_depth_m = 0.2, object_lateral_m = 0.0;
  bool operator==(const DrawerGoal&) const = default;

  double front_m() const { return 1.75 * normal_m + reaching_m + final_distance_m; }
  double reach_m() const { return final_distance_m + object_depth_m; }
  synthesizer::ActionTask task() const;
};
/// Goal of a training trial.
DrawerGoal goal_of(const synthesizer::DrawerData& data, std::size_t trial);

/// Rows of the three actions (upper-body joints, then kVelocityRows), rows × samples.
using ActionRows = std::array<Eigen::MatrixXd, synthesizer::kActions>;
/// Rows of a training trial.
ActionRows rows_of(const synthesizer::DrawerData& data, std::size_t trial);

/// Skeleton that rows belong to, and the furniture.
struct ScriptRobot {
  explicit ScriptRobot(const Robot& robot);
  const Robot* robot;
  retarget::RobotFigure figure;
  robot::RobotTree upper;
  std::vector<Eigen::Index> joint;  ///< indices in `upper`, for each of Biped::upper_body
  synthesizer::Drawer drawer;
  double pelvis_height_m;
};

inline constexpr double kStep_s = 0.8, kStanding_s = 2.4, kBegin_s = 1.0;
inline constexpr double kArrives = 0.95;  ///< right hand at the object: share of action 3
inline constexpr double kHolds_s = 1.0;   ///< after action 3
inline constexpr double kScript_s = kBegin_s + kStep_s + 6 * kStep_s + kStanding_s + kHolds_s;

/// What a script tells a walker of its goal, beside rows.
struct Led {
  /// Landings of the feet. False: the pattern generator makes them from the velocity rows alone,
  /// which ask for each landing the mean from half a step before it until half a step after it: the
  /// pelvis passes above a foot in the middle of its stance. [M18 3.8.2: "returning the foot
  /// placements"]
  bool feet = true;
  /// Handle and object. False: the hands are where the joints' rows have them.
  bool hands = true;
};

/// Actions 1, 1, 2, 3 of given rows as a walker's wishes, without a synthesizer: the first action
/// is action 1 from standing (one and a half steps long). Feet land where `goal` has them; in
/// action 3 the hands are where the joints have them from a pelvis above the feet, plus the
/// remaining distance to handle and object, growing in [M18 eq. 3.12]. `led` takes either away;
/// what is left of the goal are then handle and object, as seen from the feet that stand.
class Script {
 public:
  Script(const ScriptRobot& robot, ActionRows rows, const DrawerGoal& goal, Led led = {});

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
  void wish_velocity(const walker::PatternSample& plan);
  void wish_hands();
  Eigen::Vector3d hand_W_m(robot::Side side, double phase);

  const ScriptRobot* robot_;
  ActionRows rows_;
  Led led_;
  Eigen::MatrixXd travel_;  ///< asked by the velocity rows, at every sample of the four actions
  double feet_distance_m_;
  std::array<double, 6> landing_m_;  ///< x of the steps, right foot first
  double stand_m_;                   ///< x of the feet in action 3
  int number_ = -1, steps_ = 0;
  double time_s_ = 0.0, phase_ = 0.0, stood_s_ = 0.0, since_s_ = 0.0;
  robot::Kinematics kinematics_;
  std::array<Eigen::Vector3d, 2> target_W_m_, left_over_m_;
  Eigen::VectorXd q_, dq_, aim_, aim_rate_, offset_, offset_rate_;
  walker::WalkerWish wish_;
};

/// Row values at phase [0, 1], linear between samples.
Eigen::VectorXd at_phase(const Eigen::MatrixXd& rows, double phase);

/// Output of a walker for a script, tick by tick.
struct Recording {
  struct Tick {
    int number = -1;     ///< number of the action, see Script
    double phase = 0.0;  ///< share of it
    Eigen::VectorXd q;   ///< set-points of all joints
    Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
    walker::PatternSample plan;
  };
  std::vector<Tick> ticks;
  int clipped = 0, failed = 0, limited = 0;  ///< ticks
  std::string trouble;                       ///< first one

  /// First tick of an action, if it comes.
  std::optional<std::size_t> begin(int number) const;
};

/// Runs a script through pattern generator, filter and stack, without physics and without feedback
/// of balance: the dynamically feasible part of the script's kinematics [M18 3.8.3].
Recording record(const ScriptRobot& robot, Script script);

/// One action of a recording: rows × samples at even phases, linear between ticks. `row`: rows of a
/// tick.
template <class Row>
Eigen::MatrixXd resample(const Recording& recording, int number, int samples, const Row& row) {
  Eigen::MatrixXd out;
  std::size_t i = recording.begin(number).value();
  for (int k = 0; k < samples; ++k) {
    const double phase = static_cast<double>(k) / samples;
    const auto& t = recording.ticks;
    while (i + 1 < t.size() && t[i + 1].number == number && t[i + 1].phase <= phase) ++i;
    const bool last = i + 1 >= t.size();
    const double next = last || t[i + 1].number != number ? 1.0 : t[i + 1].phase;
    const double u = next > t[i].phase ? (phase - t[i].phase) / (next - t[i].phase) : 0.0;
    const Eigen::VectorXd here = row(t[i]);
    if (k == 0) out.resize(here.size(), samples);
    out.col(k) = last ? here : here + std::clamp(u, 0.0, 1.0) * (row(t[i + 1]) - here).eval();
  }
  return out;
}

/// Training data that a pattern generator has made feasible: the trials of `data` in the same
/// order, with recorded rows.
struct FeasibleData {
  /// Rows as those of `data`: upper-body joints, then kVelocityRows.
  synthesizer::DrawerData upper_body;
  synthesizer::DrawerData joints;  ///< angles of all joints
  std::vector<Recording> recordings;
};
/// @param led  in the walks that are recorded. With landings, the forward rows are the mean of a
/// step and have the labels' travel; without, they are the pelvis' velocity as it is.
FeasibleData make_feasible(const ScriptRobot& robot, const synthesizer::DrawerData& data,
                           Led led = {});

}  // namespace mimesis::walk
