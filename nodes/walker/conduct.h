#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "common/math/minimum_jerk.h"

namespace mimesis::walker {

enum class Phase {
  waiting,      ///< sends nothing
  enabling,     ///< sends the robot's present posture until the drives follow
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
  std::string_view paused;     ///< that the walker itself stood still, so the robot was held
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

  Phase step(const Condition& now, double dt_s) {
    const bool powered = phase_ != Phase::waiting && phase_ != Phase::enabling;
    if (powered && !now.actuators.empty()) {
      fell_ = false;
      enter(Phase::waiting, now.actuators);
      return phase_;
    }
    switch (phase_) {
      case Phase::waiting:
        wait(now, dt_s);
        break;
      case Phase::enabling:
        enable(now);
        break;
      case Phase::approaching:
        approach(now);
        break;
      case Phase::balancing:
        balance(now, dt_s);
        break;
      case Phase::safe:
        hold(now, dt_s);
        break;
    }
    return phase_;
  }
  Phase phase() const { return phase_; }
  /// Balancing without sensors, by plan alone and without new steps.
  bool blind() const { return phase_ == Phase::balancing && blind_for_s_ > 0.0; }
  /// Reason of the phase or of blindness; empty if it balances and all is well.
  const std::string& reason() const { return reason_; }

 private:
  static constexpr std::string_view kOnTheWay = "on the way to half-sitting";
  static std::string_view first(std::string_view a, std::string_view b) {
    return a.empty() ? b : a;
  }

  void enter(Phase phase, std::string_view reason) {
    phase_ = phase;
    reason_ = reason;
    waited_s_ = blind_for_s_ = well_for_s_ = 0.0;
  }
  void wait(const Condition& now, double dt_s) {
    waited_s_ += dt_s;
    const std::string_view why = first(now.sensors, now.posture);
    if (!why.empty()) {
      reason_ = why;
    } else if (waited_s_ >= settings_.silence_s) {
      enter(Phase::enabling, now.actuators);
    }
  }
  void enable(const Condition& now) {
    const std::string_view why = first(now.sensors, now.posture);
    if (!why.empty()) {
      enter(Phase::waiting, why);
    } else if (now.actuators.empty()) {
      enter(Phase::approaching, kOnTheWay);
    } else {
      reason_ = now.actuators;
    }
  }
  void approach(const Condition& now) {
    const std::string_view why = first(now.sensors, now.posture);
    if (!why.empty()) {
      enter(Phase::safe, why);
    } else if (now.approached) {
      enter(Phase::balancing, {});
    }
  }
  void balance(const Condition& now, double dt_s) {
    if (!now.falling.empty()) {
      enter(Phase::safe, now.falling);
      fell_ = true;
      return;
    }
    if (!now.paused.empty()) return enter(Phase::safe, now.paused);
    if (now.sensors.empty()) {
      blind_for_s_ = 0.0;
      reason_.clear();
      return;
    }
    blind_for_s_ += dt_s;
    reason_ = now.sensors;
    if (now.stands || blind_for_s_ > settings_.blind_s) {
      enter(Phase::safe, std::string(reason_));
    }
  }
  void hold(const Condition& now, double dt_s) {
    if (fell_) return;
    well_for_s_ = first(now.sensors, now.posture).empty() ? well_for_s_ + dt_s : 0.0;
    if (well_for_s_ >= settings_.recovery_s) enter(Phase::approaching, kOnTheWay);
  }

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
             const Eigen::VectorXd& max_speed, double speed_share, double least_s) {
    from_ = from;
    way_ = to - from;
    q_ = from;
    dq_.setZero(from.size());
    t_s_ = 0.0;
    duration_s_ = least_s;
    for (Eigen::Index j = 0; j < way_.size(); ++j) {
      const double least =
          math::kMinimumJerkPeak * std::abs(way_[j]) / (speed_share * max_speed[j]);
      duration_s_ = std::max(duration_s_, least);
    }
  }
  /// no allocation
  void step(double dt_s) {
    t_s_ = std::min(t_s_ + dt_s, duration_s_);
    const double s = duration_s_ > 0.0 ? t_s_ / duration_s_ : 1.0;
    q_ = from_ + math::minimum_jerk(s) * way_;
    dq_ = way_ * (math::minimum_jerk_rate(s) / std::max(duration_s_, dt_s));
  }

  const Eigen::VectorXd& q() const { return q_; }    ///< [rad]
  const Eigen::VectorXd& dq() const { return dq_; }  ///< [rad/s]
  bool done() const { return t_s_ >= duration_s_; }
  double duration_s() const { return duration_s_; }

 private:
  Eigen::VectorXd from_, way_, q_, dq_;
  double duration_s_ = 0.0, t_s_ = 0.0;
};

}  // namespace mimesis::walker
