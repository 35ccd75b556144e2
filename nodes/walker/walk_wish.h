#pragma once
#include <string>

#include "nodes/walker/walker.h"

namespace mimesis::walker {

/// A wished motion in terms of the robot, without limits.
struct MotionWish {
  /// velocity of the pelvis: forward, left
  Eigen::Vector2d velocity_m_s = Eigen::Vector2d::Zero();
  double yaw_rate_rad_s = 0.0;                           ///< + to the left
  Eigen::Vector2d pelvis_W_m = Eigen::Vector2d::Zero();  ///< place of the motion
  double heading_rad = 0.0;                              ///< heading of the pelvis in W
  bool stands = false;                                   ///< the motion asks to stand
  std::array<std::optional<Footprint>, 2> landing;       ///< next swing foot, the one after it
  /// [rad], [rad/s], in the order of Biped::upper_body; empty: no wish.
  Eigen::VectorXd upper_body, upper_body_rate;
  std::array<TaskGoals::Hand, 2> hand;  ///< left, right
};

/// Place of the robot on the ground: middle of its feet.
struct GroundPose {
  Eigen::Vector2d p_W_m = Eigen::Vector2d::Zero();
  double yaw_rad = 0.0;
};

struct WalkWishSettings {
  double least_m_s = 0.01, least_rad_s = 0.02;  ///< slower motions count as standing
  /// Velocity that is added to return to the motion's place: gain times distance, bounded. 0: none.
  double drift_gain_1_s = 0.3, drift_most_m_s = 0.04, drift_most_rad_s = 0.05;
  double fade_s = 1.0;  ///< transition of the upper body when a motion begins or ends
};

/// Turns a wished motion into a wish within the robot's limits, tick by tick:
/// - velocities plus clamp(k (p_motion − p_robot)) in the heading frame; a motion with footprints
///   gets no such correction. The pattern limits them to the robot's limits; here it is only
/// reported; - the upper body within the joints' limits. When a motion begins or ends, the
/// difference to the
///   posture before fades as 1 − (10 s³ − 15 s⁴ + 6 s⁵). Walker keeps the joints' speeds.
class WalkWish {
 public:
  WalkWish(const robot::Biped& biped, const GaitSettings& gait, const WalkWishSettings& settings);

  void reset();  ///< half-sitting
  /// `motion`: null if there is none; then the robot stops and its upper body returns to
  /// half-sitting. Does not allocate.
  const WalkerWish& step(const MotionWish* motion, const GroundPose& robot, double dt_s);
  /// One line about the first value that was cut in the last step; empty if none was.
  const std::string& clipped() const { return clipped_; }

 private:
  void walk(const MotionWish& motion, const GroundPose& robot);
  void move_upper_body(const MotionWish* motion, double dt_s);
  void cut(const char* what, double wished, double most);

  GaitSettings gait_;
  WalkWishSettings settings_;
  Eigen::VectorXd lower_, upper_, rest_;  ///< Biped::upper_body order
  std::vector<std::string> joints_;
  Eigen::VectorXd target_, difference_;
  double faded_s_ = 0.0;
  bool follows_ = false;  ///< a motion's upper body
  WalkerWish wish_;
  std::string clipped_;
};

}  // namespace mimesis::walker
