#pragma once
#include <string>
#include <string_view>

namespace mimesis::walker {

enum class Phase {
  kWaiting,      ///< sends nothing
  kArming,       ///< sends the posture that the robot has, until its drives follow
  kApproaching,  ///< slowly to half-sitting
  kBalancing,    ///< stands or walks by plan and feedback
  kSafe,         ///< holds its posture
};

/// What is known of the robot at a tick. A line that is empty: all is well.
struct Condition {
  std::string_view sensors;    ///< why encoders, IMU or foot forces cannot be used
  std::string_view actuators;  ///< why the drives do not follow
  std::string_view posture;    ///< why balance cannot begin from how the robot stands
  std::string_view falling;    ///< why it cannot be kept up
  bool stands = true;          ///< the plan has no step in it
  bool approached = false;     ///< half-sitting is reached
};

struct ConductSettings {
  double blind_s = 3.0;     ///< without sensors at most, before the posture is held
  double recovery_s = 0.5;  ///< sensors are well for so long before balance begins anew
  double silence_s = 0.25;  ///< nothing is sent after the drives stopped: the bridge asks for 0.1 s
};

/// What a walker may do, from what is known of its robot. Who falls is safe until the drives were
/// disabled; who lost its sensors until they are back.
class Conduct {
 public:
  explicit Conduct(const ConductSettings& settings) : settings_(settings) {}

  Phase step(const Condition& now, double dt_s);
  Phase phase() const { return phase_; }
  /// Balancing without sensors: by plan alone, and no new steps.
  bool blind() const { return phase_ == Phase::kBalancing && blind_for_s_ > 0.0; }
  /// Of the phase, or why it is blind; empty if it balances and all is well.
  const std::string& reason() const { return reason_; }

 private:
  void enter(Phase phase, std::string_view reason);
  void wait(const Condition& now, double dt_s);
  void arm(const Condition& now);
  void approach(const Condition& now);
  void balance(const Condition& now, double dt_s);
  void hold(const Condition& now, double dt_s);

  ConductSettings settings_;
  Phase phase_ = Phase::kWaiting;
  std::string reason_;
  bool fell_ = false;
  double waited_s_ = 1e9, blind_for_s_ = 0.0, well_for_s_ = 0.0;
};

}  // namespace mimesis::walker
