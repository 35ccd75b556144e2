#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "hw/arm/axis.h"
#include "hw/arm/canopen.h"
#include "hw/arm/cia402.h"

namespace mimesis::hw::arm {

inline constexpr int kMasterNode = 127;                ///< node id of our heartbeat
inline constexpr int kMasterHeartbeatMs = 100;         ///< we send
inline constexpr int kMasterHeartbeatTimeoutMs = 250;  ///< drives stop after
inline constexpr int kDriveHeartbeatMs = 100;          ///< drives send
inline constexpr int kDriveHeartbeatTimeoutMs = 250;   ///< we stop after
inline constexpr int kRpdoDeadlineMs = 100;            ///< drives stop without set-points after

/// One SDO access on the way to a configured drive.
struct SetupStep {
  enum class Kind : std::uint8_t {
    expect,         ///< upload; value under `mask` must be equal
    expect_least,   ///< upload; value must be at least as large
    write,          ///< download
    write_checked,  ///< download, then upload: the drive must have kept it
  };
  Kind kind;
  Object object;
  std::uint32_t value;
  int bytes;
  const char* meaning;
  std::uint32_t mask = 0xFFFFFFFF;
};

/// Interpolation period 60C2h: value · 10^exponent seconds.
struct Period {
  std::uint8_t value;
  std::int8_t exponent;
};
/// @throws ConfigError if 1/rate is no whole number of 0.1 ms up to 255
Period period_of(double rate_hz);

/// What makes a drive follow positions synchronously and stop by itself when we are gone.
/// Afterwards:
///   RPDO1 controlword 6040h (2 B), target position 607Ah (4 B), taken with SYNC
///   TPDO1 statusword 6041h (2 B), position 6064h (4 B), torque 6077h (2 B), sent on SYNC
///   TPDO2 velocity 606Ch (4 B), sent on SYNC; of a drive that stays powered also its position
///         demand 6062h (4 B): a loaded joint does not stand where its motor is held
/// @param q_min,q_max [rad], v_max [rad/s], a_max [rad/s²]: limits of the joint
std::vector<SetupStep> setup_steps(const Axis& axis, double q_min, double q_max, double v_max,
                                   double a_max, Period period,
                                   QuickStop quick_stop = QuickStop::disables);

}  // namespace mimesis::hw::arm
