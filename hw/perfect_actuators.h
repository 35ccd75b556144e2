#pragma once
#include <vector>

#include "common/error.h"
#include "hw/actuators.h"
#include "hw/setpoint_limiter.h"

namespace mimesis::hw {

/// Joints without hardware that are at once where the limited set-point is. A stop takes effect at
/// once. Pure; for trying a robot and for tests. The robot file selects it by `drives: perfect`.
class PerfectActuators final : public Actuators {
 public:
  struct Options {
    JointLimits limits;
    std::vector<double> home_rad;  ///< where the joints stand at first, one per joint
    double rate_hz = 200.0;        ///< rate of read and write
    bool stays_powered = false;    ///< a stop leaves the joints powered
    bool readonly = false;         ///< set-points are ignored
  };
  explicit PerfectActuators(Options options)
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

  const Reading& read(Time) override {
    if (reading_.phase == Phase::enabling) reading_.phase = Phase::following;
    return reading_;
  }
  void write(Time, const Setpoint& setpoint) override {
    if (options_.readonly) return;
    if (setpoint.mode == Mode::idle) return stop();
    if (reading_.phase == Phase::following) {
      limiter_.coast(setpoint.missed);
      if (setpoint.mode == Mode::hold) {
        limiter_.hold();
      } else {
        reading_.limited += limiter_.follow(setpoint.position_rad, setpoint.brakes) ? 1 : 0;
      }
    } else if (setpoint.mode == Mode::follow) {
      reading_.phase = Phase::enabling;
    } else {
      return;
    }
    show(DriveState::operation_enabled);
  }
  void stop() noexcept override {
    const bool enabled = reading_.phase == Phase::following || reading_.phase == Phase::enabling;
    if (!enabled) return;
    reading_.phase = options_.stays_powered ? Phase::holding : Phase::idle;
    limiter_.rest();
    show(options_.stays_powered ? DriveState::quick_stop_active : DriveState::switch_on_disabled);
  }

 private:
  void show(DriveState state) noexcept {
    for (std::size_t i = 0; i < reading_.joints.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      reading_.joints[i] = {.position_rad = limiter_.position()[k],
                            .velocity_rad_s = limiter_.velocity()[k],
                            .drive = state};
    }
  }

  Options options_;
  SetpointLimiter limiter_;
  Reading reading_;
};

}  // namespace mimesis::hw
