#include "hw/cia402/cia402.h"

#include <algorithm>
#include <array>

namespace mimesis::hw::cia402 {

namespace {

/// A state and the bits of the statusword by which it is known; where bit 5 (quick stop) does not
/// matter it is not in the mask.
struct Shown {
  DriveState state;
  unsigned mask, bits;
};
constexpr std::array kShown = {Shown{DriveState::not_ready_to_switch_on, 0x4F, 0x00},
                               Shown{DriveState::switch_on_disabled, 0x4F, 0x40},
                               Shown{DriveState::fault_reaction_active, 0x4F, 0x0F},
                               Shown{DriveState::fault, 0x4F, 0x08},
                               Shown{DriveState::ready_to_switch_on, 0x6F, 0x21},
                               Shown{DriveState::switched_on, 0x6F, 0x23},
                               Shown{DriveState::operation_enabled, 0x6F, 0x27},
                               Shown{DriveState::quick_stop_active, 0x6F, 0x07}};

}  // namespace

DriveState decode_statusword(std::uint16_t statusword) {
  for (const Shown& s : kShown) {
    if ((statusword & s.mask) == s.bits) return s.state;
  }
  return DriveState::unknown;
}

std::uint16_t towards_enabled(DriveState state, std::uint16_t previous, QuickStop quick_stop) {
  using namespace controlword;
  switch (state) {
    case DriveState::fault:
      return previous == kFaultReset ? kDisableVoltage : kFaultReset;
    case DriveState::switch_on_disabled:
      return kShutdown;
    case DriveState::ready_to_switch_on:
      return kSwitchOn;
    case DriveState::switched_on:
    case DriveState::operation_enabled:
      return kEnableOperation;
    case DriveState::quick_stop_active:
      return quick_stop == QuickStop::stays_powered ? kEnableOperation : kDisableVoltage;
    default:
      return kDisableVoltage;
  }
}

DriveState transition(DriveState state, std::uint16_t word, std::uint16_t previous,
                      QuickStop quick_stop_option) {
  const bool reset_edge = (word & 0x80) != 0 && (previous & 0x80) == 0;
  const bool disable_voltage = (word & 0x02) == 0;
  const bool quick_stop = (word & 0x06) == 0x02;
  const bool shutdown = (word & 0x07) == 0x06;
  const bool switch_on = (word & 0x07) == 0x07;
  const bool enable = (word & 0x0F) == 0x0F;
  switch (state) {
    case DriveState::fault:
      return reset_edge ? DriveState::switch_on_disabled : state;
    case DriveState::switch_on_disabled:
      return shutdown ? DriveState::ready_to_switch_on : state;
    case DriveState::ready_to_switch_on:
      if (disable_voltage || quick_stop) return DriveState::switch_on_disabled;
      return switch_on ? DriveState::switched_on : state;
    case DriveState::switched_on:
    case DriveState::operation_enabled:
      if (disable_voltage) return DriveState::switch_on_disabled;
      if (quick_stop) {
        return state == DriveState::operation_enabled ? DriveState::quick_stop_active
                                                      : DriveState::switch_on_disabled;
      }
      if (shutdown) return DriveState::ready_to_switch_on;
      if (enable) return DriveState::operation_enabled;
      return switch_on ? DriveState::switched_on : state;
    case DriveState::quick_stop_active:
      if (disable_voltage) return DriveState::switch_on_disabled;
      return enable && quick_stop_option == QuickStop::stays_powered ? DriveState::operation_enabled
                                                                     : state;
    default:
      return state;
  }
}

DriveState next_towards_enabled(DriveState state, QuickStop quick_stop) {
  return transition(state, towards_enabled(state, 0, quick_stop), 0, quick_stop);
}

}  // namespace mimesis::hw::cia402
