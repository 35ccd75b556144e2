#pragma once
#include <vector>

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
  explicit PerfectActuators(Options options);

  const Reading& read(Time now) override;
  void write(Time now, const Setpoint& setpoint) override;
  void stop() noexcept override;

 private:
  void show(DriveState state) noexcept;

  Options options_;
  SetpointLimiter limiter_;
  Reading reading_;
};

}  // namespace mimesis::hw
