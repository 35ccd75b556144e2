#pragma once
#include <optional>
#include <span>
#include <vector>

#include "nodes/synthesizer/biped/robot_walk.h"
#include "nodes/synthesizer/director.h"

namespace mimesis::synthesizer {

/// A wish for one hand: the point between its fingers.
struct HandWish {
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
  double share = 0.0;  ///< 0: the joints decide; 1: the hand does
};

/// What a robot is wished to do in one instant.
struct RobotMotion {
  double phase_rad = 0.0, phase_rate_rad_s = 0.0;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< forward, left [m/s], turn [rad/s]
  Eigen::Vector3d pelvis_W_m = Eigen::Vector3d::Zero();
  double heading_rad = 0.0;
  mocap::Side support = mocap::kLeft;
  bool stands = true;
  std::array<std::optional<SolePrint>, 2> landing;  ///< of the next swing foot, the one after it
  std::array<std::optional<HandWish>, 2> hand;      ///< left, right
  const char* action = "stand";
};

/// Leads a walking robot: RobotWalk says where it goes, and the model's motion gives it arms and
/// trunk in the rhythm of its own steps: the leading oscillator is coupled to the robot's clock
/// [M18 eq. 3.18], and the shares of walk and stand are those of the length of its steps.
class RobotDirector {
 public:
  /// @param walkers  one character, in mode free; outlives this
  RobotDirector(Walkers& walkers, const RobotLimits& limits, const WalkSettings& walk);

  void walk_to(const Eigen::Vector2d& goal_W_m);
  void stop();

  /// @param feedback  null: none, the robot is believed to do as it is told
  void step(const RobotFeedback* feedback);

  const RobotMotion& motion() const { return motion_; }
  std::span<const float> angles() const { return angles_; }  ///< rows of the model [rad]
  Progress progress() const;

 private:
  void move_character();

  Walkers& walkers_;
  double step_s_;
  RobotWalk walk_;
  GoalKind kind_ = GoalKind::none;
  RobotMotion motion_;
  std::vector<float> angles_;
};

}  // namespace mimesis::synthesizer
