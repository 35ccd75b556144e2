#include "hw/actuators.h"

#include "common/error.h"

namespace mimesis::hw {

const char* name(DriveState state) {
  switch (state) {
    case DriveState::unknown:
      return "unknown";
    case DriveState::not_ready_to_switch_on:
      return "not ready to switch on";
    case DriveState::switch_on_disabled:
      return "switch on disabled";
    case DriveState::ready_to_switch_on:
      return "ready to switch on";
    case DriveState::switched_on:
      return "switched on";
    case DriveState::operation_enabled:
      return "operation enabled";
    case DriveState::quick_stop_active:
      return "quick stop active";
    case DriveState::fault_reaction_active:
      return "fault reaction active";
    case DriveState::fault:
      return "fault";
  }
  MIMESIS_ASSERT(false);
}

const char* name(Phase phase) {
  switch (phase) {
    case Phase::starting:
      return "starting";
    case Phase::idle:
      return "idle";
    case Phase::enabling:
      return "enabling";
    case Phase::following:
      return "following";
    case Phase::stopping:
      return "quick_stop";
    case Phase::fault:
      return "fault";
    case Phase::holding:
      return "holding";
  }
  return "";
}

}  // namespace mimesis::hw
