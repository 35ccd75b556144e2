#pragma once
#include <optional>
#include <span>
#include <vector>

#include "nodes/synthesizer/director.h"
#include "nodes/synthesizer/robot/biped_sequence.h"
#include "nodes/synthesizer/robot/robot_walk.h"

namespace mimesis::synthesizer {

/// Leads a walking robot. RobotWalk leads it to a goal, and the model's motion gives it arms and
/// trunk in the rhythm of its own steps: the leading oscillator is coupled to the robot's clock
/// [M18 eq. 3.18], and the shares of walk and stand are those of the length of its steps. To a
/// drawer, the robot stops, turns to it, and BipedDrawerSequence takes over; out of it again when
/// it has another goal. Arms and trunk go from one to the other within kFade_s.
class RobotDirector : public Director {
 public:
  /// @param starts  of one character
  /// @param drawer  null: goals of that kind are refused; outlives this
  /// @throws ConfigError if the model has no row of a joint that drawer moves
  RobotDirector(const motion::MotionModel& model, std::span<const CharacterStart> starts,
                const CharactersSettings& settings, const RobotLimits& limits,
                const BipedDrawer* drawer);

  bool leads_robot() const override { return true; }
  void walk_to(int i, const Eigen::Vector2d& goal_W_m) override;
  void stop(int i) override;
  std::string to_drawer(int i, const DrawerPlace& place) override;
  /// Steps of the wished length and heading in the rhythm that the robot has; without a length 0.2
  /// m, without a heading the present one.
  void follow(int i, const GaitWish& wish, std::optional<double> phase_rad) override;
  /// The coordinator is silent: the robot stands if it has no goal.
  void release(int i) override;
  void step(const RobotFeedback* robot, const DrawerSeen* seen) override;

  DirectedMotion motion(int) const override { return motion_; }
  std::span<const float> angles(int) const override { return angles_; }
  Progress progress(int i) const override;
  const std::vector<PlannedAction>* plan(int) const override {
    return sequence_ ? &actions_ : nullptr;
  }

  static constexpr double kFade_s = 0.8;

 private:
  void leave();
  void approach(const RobotFeedback* robot);
  void move_character();
  void show_walk(const RobotFeedback* robot);
  void show_sequence();
  void show_angles();

  const BipedDrawer* drawer_;
  RobotLimits limits_;
  double dt_s_;
  RobotWalk walk_;
  GoalKind kind_ = GoalKind::none;
  DrawerPlace task_;
  std::string refused_;  // why its sequence does not begin
  std::optional<BipedDrawerSequence> sequence_;
  std::vector<PlannedAction> actions_;
  DirectedMotion motion_;
  std::vector<std::size_t> row_;  // row of the model, for each joint of the sequence
  Eigen::VectorXd left_rad_,
      left_rate_;  // joints' difference to the walk when the sequence was left
  double left_s_ = kFade_s;
  std::vector<float> angles_;
};

}  // namespace mimesis::synthesizer
