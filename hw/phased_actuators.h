#pragma once
#include <string>

#include "hw/actuators.h"
#include "hw/setpoint_limiter.h"

namespace mimesis::hw {

/// What drivers of every kind share: the phase with its cause, and limited set-points. After a
/// fault a set-point is obeyed again only after Mode::idle.
class PhasedActuators : public Actuators {
 public:
  const Reading& reading() const { return reading_; }

 protected:
  PhasedActuators(const JointLimits& limits, double rate_hz, const std::string& searching)
      : limiter_(limits, 1.0 / rate_hz) {
    reading_.joints.resize(static_cast<std::size_t>(limits.q_min.size()));
    reading_.reason = searching;
  }

  void enter(Phase phase);
  void fault(const std::string& why);  ///< the first cause counts
  /// Changes the phase as the set-point asks, and moves the limiter. @param ready drives could be
  /// enabled now
  void obey(const Setpoint& setpoint, bool ready);
  /// After a stop that was sent outside of a cycle.
  void leave_motion() noexcept {
    if (reading_.phase == Phase::following || reading_.phase == Phase::enabling)
      enter(Phase::stopping);
  }

  SetpointLimiter limiter_;
  Reading reading_;
  Time now_{};      ///< time of the last read or write
  Time entered_{};  ///< when the phase began

 private:
  bool may_enable_ = true;  // Mode::idle was set since the last fault
};

}  // namespace mimesis::hw
