#pragma once
#include <optional>
#include <span>
#include <vector>

#include "nodes/synthesizer/biped/biped_sequence.h"
#include "nodes/synthesizer/biped/robot_walk.h"
#include "nodes/synthesizer/director.h"

namespace mimesis::synthesizer {

/// What a robot is wished to do in one instant.
struct RobotMotion {
  double phase_rad = 0.0, phase_rate_rad_s = 0.0;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< forward, left [m/s], turn [rad/s]
  Eigen::Vector3d pelvis_W_m = Eigen::Vector3d::Zero();
  double heading_rad = 0.0;
  mocap::Side support = mocap::kLeft;
  bool stands = true;
  Landings landing;                             ///< of the next swing foot, the one after it
  std::array<std::optional<HandWish>, 2> hand;  ///< left, right
  const char* action = "stand";
};

/// Leads a walking robot. To a goal, RobotWalk says where it goes, and the model's motion gives it
/// arms and trunk in the rhythm of its own steps: the leading oscillator is coupled to the robot's
/// clock [M18 eq. 3.18], and the shares of walk and stand are those of the length of its steps. To
/// a drawer, the robot stops, turns to it, and BipedDrawerSequence takes over; out of it again when
/// it has another goal. Arms and trunk go from one to the other within kFade_s.
class RobotDirector {
 public:
  /// @param walkers  one character, in mode free; outlives this
  /// @param drawer  null: goals of that kind are refused; outlives this
  /// @throws ConfigError if the model has no row of a joint that drawer moves
  RobotDirector(Walkers& walkers, const RobotLimits& limits, const WalkSettings& walk,
                const BipedDrawer* drawer);

  void walk_to(const Eigen::Vector2d& goal_W_m);
  void stop();
  /// A coordinator's wish, until the next one: steps of this length and heading, in the rhythm that
  /// the robot has. What is absent is 0.2 m, and the present heading. A goal goes before it.
  void follow(const GaitWish& wish);
  /// The coordinator is silent: stands, if it has no goal.
  void release();
  /// Why not; empty if it will be done.
  std::string to_drawer(const BipedTask& task);

  /// @param robot  null: none, the robot is believed to do as it is told
  /// @param seen  of the drawer; null: it is where the goal says
  void step(const RobotFeedback* robot, const DrawerSeen* seen);

  const RobotMotion& motion() const { return motion_; }
  std::span<const float> angles() const { return angles_; }  ///< rows of the model [rad]
  Progress progress() const;
  /// Actions left of a sequence, the one under way first; null: there is none.
  const std::vector<PlannedAction>* plan() const { return sequence_ ? &actions_ : nullptr; }

  static constexpr double kFade_s = 0.8;

 private:
  void leave();
  void approach(const RobotFeedback* robot);
  void move_character();
  void show_walk(const RobotFeedback* robot);
  void show_sequence();
  void show_angles();

  Walkers& walkers_;
  const BipedDrawer* drawer_;
  RobotLimits limits_;
  double dt_s_;
  RobotWalk walk_;
  GoalKind kind_ = GoalKind::none;
  BipedTask task_;
  std::string refused_;  // why its sequence does not begin
  std::optional<BipedDrawerSequence> sequence_;
  std::vector<PlannedAction> actions_;
  RobotMotion motion_;
  std::vector<std::size_t> row_;  // of the model, for each joint of the sequence
  Eigen::VectorXd left_rad_,
      left_rate_;  // joints' difference to the walk when the sequence was left
  double left_s_ = kFade_s;
  std::vector<float> angles_;
};

}  // namespace mimesis::synthesizer
