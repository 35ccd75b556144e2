#pragma once
#include <Eigen/Core>
#include <string>
#include <string_view>

namespace mimesis::walker {

enum class Phase {
  waiting,      ///< sends nothing
  arming,       ///< sends the robot's present posture until the drives follow
  approaching,  ///< moves slowly to half-sitting
  balancing,    ///< stands or walks by plan and feedback
  safe,         ///< holds its posture
};

/// Condition of the robot at a tick. An empty line means that all is well.
struct Condition {
  std::string_view sensors;    ///< why encoders, IMU or foot forces cannot be used
  std::string_view actuators;  ///< why the drives do not follow
  std::string_view posture;    ///< why balance cannot begin from how the robot stands
  std::string_view falling;    ///< why it counts as falling
  bool stands = true;          ///< the plan has no step in it
  bool approached = false;     ///< half-sitting is reached
};

struct ConductSettings {
  double blind_s = 3.0;     ///< longest time without sensors before the posture is held
  double recovery_s = 0.5;  ///< time of good sensors before balance begins again
  double silence_s = 0.25;  ///< silence after the drives stopped; the bridge asks for 0.1 s
};

/// Decides what the walker may do from the condition of its robot. After a fall the phase is safe
/// until the drives were disabled, after lost sensors until they are back.
class Conduct {
 public:
  explicit Conduct(const ConductSettings& settings) : settings_(settings) {}

  Phase step(const Condition& now, double dt_s);
  Phase phase() const { return phase_; }
  /// Balancing without sensors, by plan alone and without new steps.
  bool blind() const { return phase_ == Phase::balancing && blind_for_s_ > 0.0; }
  /// Reason of the phase or of blindness; empty if it balances and all is well.
  const std::string& reason() const { return reason_; }

 private:
  void enter(Phase phase, std::string_view reason);
  void wait(const Condition& now, double dt_s);
  void arm(const Condition& now);
  void approach(const Condition& now);
  void balance(const Condition& now, double dt_s);
  void hold(const Condition& now, double dt_s);

  ConductSettings settings_;
  Phase phase_ = Phase::waiting;
  std::string reason_;
  bool fell_ = false;
  double waited_s_ = 1e9, blind_for_s_ = 0.0, well_for_s_ = 0.0;
};

/// Slow movement of all joints from posture a to posture b with minimum jerk:
/// q = a + (b − a)(10 s³ − 15 s⁴ + 6 s⁵), s = t/T [Flash, Hogan 1985].
class Approach {
 public:
  /// Keeps every joint below `speed_share` · `max_speed` (dof [rad/s]); takes at least `least_s`.
  void start(const Eigen::VectorXd& from, const Eigen::VectorXd& to,
             const Eigen::VectorXd& max_speed, double speed_share, double least_s);
  void step(double dt_s);  ///< no allocation

  const Eigen::VectorXd& q() const { return q_; }    ///< [rad]
  const Eigen::VectorXd& dq() const { return dq_; }  ///< [rad/s]
  bool done() const { return t_s_ >= duration_s_; }
  double duration_s() const { return duration_s_; }

 private:
  Eigen::VectorXd from_, way_, q_, dq_;
  double duration_s_ = 0.0, t_s_ = 0.0;
};

}  // namespace mimesis::walker
