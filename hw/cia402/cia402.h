#pragma once
#include <cstdint>

#include "hw/actuators.h"
#include "hw/cia402/canopen.h"

/// Drive profile [CiA 402-2]: state machine and objects. Pure.
namespace mimesis::hw::cia402 {

/// State shown by statusword 6041h.
DriveState decode_statusword(std::uint16_t statusword);

/// Commands in controlword 6040h.
namespace controlword {
inline constexpr std::uint16_t kDisableVoltage = 0x00, kQuickStop = 0x02, kShutdown = 0x06,
                               kSwitchOn = 0x07, kEnableOperation = 0x0F, kFaultReset = 0x80;
/// For an enabled drive: a new set-point of profile position (at once, not after the present one),
/// or the start of homing.
inline constexpr std::uint16_t kNewSetpoint = 0x10, kAtOnce = 0x20, kStartHoming = 0x10;
}  // namespace controlword

/// Bits of statusword 6041h that depend on the mode.
namespace statusword {
inline constexpr std::uint16_t kReached = 0x0400, kAcknowledged = 0x1000, kHomingError = 0x2000;
}

/// End of a drive's quick stop (605Ah).
enum class QuickStop : std::uint8_t {
  disables = 2,       ///< slow down on the quick stop ramp, then switch on disabled
  stays_powered = 6,  ///< slow down on the quick stop ramp, then stay in quick stop active
};

/// Next controlword on the way from `state` to operation enabled. A fault is left by the rising
/// edge of bit 7, so `previous`, the controlword sent last, decides between 0 and fault reset.
std::uint16_t towards_enabled(DriveState state, std::uint16_t previous,
                              QuickStop quick_stop = QuickStop::disables);
/// State that `controlword` leads to from `state`; `state` itself if it has no effect there. Quick
/// stop from operation enabled leads to quick stop active; back only if it stays powered
/// (transition 16).
DriveState transition(DriveState state, std::uint16_t controlword, std::uint16_t previous,
                      QuickStop quick_stop = QuickStop::disables);

/// State that follows `state` on the way to operation enabled.
DriveState next_towards_enabled(DriveState state, QuickStop quick_stop = QuickStop::disables);

/// Mode of operation 6060h.
enum class OperationMode : std::int8_t {
  profile_position = 1,
  profile_velocity = 3,
  homing = 6,
  cyclic_position = 8,
  cyclic_velocity = 9,
  cyclic_torque = 10,
};

namespace object {
inline constexpr Object kDeviceType{0x1000, 0}, kGuardTime{0x100C, 0}, kLifeTimeFactor{0x100D, 0},
    kMasterHeartbeat{0x1016, 1}, kHeartbeatTime{0x1017, 0}, kHeartbeatLost{0x1029, 1},
    kRpdo1Deadline{0x1400, 5}, kAbortOption{0x6007, 0}, kControlword{0x6040, 0},
    kStatusword{0x6041, 0}, kQuickStopOption{0x605A, 0}, kMode{0x6060, 0}, kModeDisplay{0x6061, 0},
    kDemand{0x6062, 0}, kPosition{0x6064, 0}, kFollowingWindow{0x6065, 0},
    kFollowingTime{0x6066, 0}, kVelocity{0x606C, 0}, kTargetTorque{0x6071, 0}, kTorque{0x6077, 0},
    kTarget{0x607A, 0}, kPositionMin{0x607D, 1}, kPositionMax{0x607D, 2}, kMaxVelocity{0x607F, 0},
    kProfileVelocity{0x6081, 0}, kProfileAcceleration{0x6083, 0}, kProfileDeceleration{0x6084, 0},
    kQuickStopDeceleration{0x6085, 0}, kHomingMethod{0x6098, 0}, kHomingSearchSpeed{0x6099, 1},
    kHomingZeroSpeed{0x6099, 2}, kHomingAcceleration{0x609A, 0}, kPeriodValue{0x60C2, 1},
    kPeriodExponent{0x60C2, 2}, kDigitalInputs{0x60FD, 0}, kTargetVelocity{0x60FF, 0},
    kSupportedModes{0x6502, 0};
}  // namespace object

}  // namespace mimesis::hw::cia402
