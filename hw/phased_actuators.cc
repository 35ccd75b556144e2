#include "hw/phased_actuators.h"

namespace mimesis::hw {

void PhasedActuators::enter(Phase phase) {
  reading_.phase = phase;
  entered_ = now_;
  if (phase != Phase::fault && phase != Phase::starting) reading_.reason.clear();
}

void PhasedActuators::fault(const std::string& why) {
  if (reading_.phase == Phase::fault && !reading_.reason.empty()) return;
  may_enable_ = false;
  enter(Phase::fault);
  reading_.reason = why;
}

void PhasedActuators::obey(const Setpoint& setpoint, bool ready) {
  switch (reading_.phase) {
    case Phase::idle:
    case Phase::holding:
    case Phase::fault:
      if (setpoint.mode != Mode::follow) {
        may_enable_ = true;
      } else if (may_enable_ && ready && reading_.posture_known) {
        enter(Phase::enabling);
      }
      return;
    case Phase::enabling:
      if (setpoint.mode == Mode::idle) enter(Phase::stopping);
      return;
    case Phase::following:
      limiter_.coast(setpoint.missed);
      if (setpoint.mode == Mode::idle) {
        enter(Phase::stopping);
      } else if (setpoint.mode == Mode::hold) {
        limiter_.hold();
      } else {
        reading_.limited += limiter_.follow(setpoint.position_rad, setpoint.brakes) ? 1 : 0;
      }
      return;
    case Phase::starting:
    case Phase::stopping:
      return;
  }
}

}  // namespace mimesis::hw
