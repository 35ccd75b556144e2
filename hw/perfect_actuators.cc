#include "hw/perfect_actuators.h"

#include "common/error.h"

namespace mimesis::hw {

PerfectActuators::PerfectActuators(Options options)
    : options_(std::move(options)), limiter_(options_.limits, 1.0 / options_.rate_hz) {
  const auto joints = static_cast<std::size_t>(options_.limits.q_min.size());
  MIMESIS_ASSERT(options_.home_rad.size() == joints);
  limiter_.reset(options_.home_rad);
  reading_ = {.phase = Phase::idle,
              .posture_known = true,
              .joints = std::vector<JointReading>(joints),
              .reason = options_.readonly ? "read-only" : ""};
  show(DriveState::switch_on_disabled);
}

void PerfectActuators::show(DriveState state) noexcept {
  for (std::size_t i = 0; i < reading_.joints.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    reading_.joints[i] = {.position_rad = limiter_.position()[k],
                          .velocity_rad_s = limiter_.velocity()[k],
                          .drive = state};
  }
}

const Reading& PerfectActuators::read(Time) {
  if (reading_.phase == Phase::enabling) reading_.phase = Phase::following;
  return reading_;
}

void PerfectActuators::write(Time, const Setpoint& setpoint) {
  if (options_.readonly) return;
  if (setpoint.mode == Mode::idle) return stop();
  if (reading_.phase == Phase::following) {
    if (setpoint.mode == Mode::hold) {
      limiter_.hold();
    } else {
      reading_.limited += limiter_.follow(setpoint.position_rad) ? 1 : 0;
    }
  } else if (setpoint.mode == Mode::follow) {
    reading_.phase = Phase::enabling;
  } else {
    return;
  }
  show(DriveState::operation_enabled);
}

void PerfectActuators::stop() noexcept {
  const bool enabled = reading_.phase == Phase::following || reading_.phase == Phase::enabling;
  if (!enabled) return;
  reading_.phase = options_.stays_powered ? Phase::holding : Phase::idle;
  limiter_.rest();
  show(options_.stays_powered ? DriveState::quick_stop_active : DriveState::switch_on_disabled);
}

}  // namespace mimesis::hw
