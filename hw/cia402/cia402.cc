#include "hw/cia402/cia402.h"

namespace mimesis::hw::cia402 {

DriveState decode_statusword(std::uint16_t statusword) {
  switch (statusword & 0x4F) {  // states in which bit 5 (quick stop) does not matter
    case 0x00:
      return DriveState::not_ready_to_switch_on;
    case 0x40:
      return DriveState::switch_on_disabled;
    case 0x0F:
      return DriveState::fault_reaction_active;
    case 0x08:
      return DriveState::fault;
    default:
      break;
  }
  switch (statusword & 0x6F) {
    case 0x21:
      return DriveState::ready_to_switch_on;
    case 0x23:
      return DriveState::switched_on;
    case 0x27:
      return DriveState::operation_enabled;
    case 0x07:
      return DriveState::quick_stop_active;
    default:
      return DriveState::unknown;
  }
}

std::uint16_t encode_statusword(DriveState state) {
  const auto bits = [state]() -> unsigned {
    switch (state) {
      case DriveState::switch_on_disabled:
        return 0x40;
      case DriveState::ready_to_switch_on:
        return 0x21;
      case DriveState::switched_on:
        return 0x23;
      case DriveState::operation_enabled:
        return 0x27;
      case DriveState::quick_stop_active:
        return 0x07;
      case DriveState::fault_reaction_active:
        return 0x0F;
      case DriveState::fault:
        return 0x08;
      default:
        return 0x00;
    }
  }();
  return static_cast<std::uint16_t>(bits | 0x0210);
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
