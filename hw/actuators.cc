#include "hw/actuators.h"

#include <fmt/core.h>

#include <array>

namespace mimesis::hw {

const char* name(DriveState state) {
  constexpr std::array kNames = {
      "unknown",     "not ready to switch on", "switch on disabled", "ready to switch on",
      "switched on", "operation enabled",      "quick stop active",  "fault reaction active",
      "fault"};
  return kNames.at(static_cast<std::size_t>(state));
}

std::string text(const JointReading& joint) {
  return fmt::format("{} (statusword 0x{:04X})", name(joint.drive), joint.statusword);
}

const char* name(Phase phase) {
  constexpr std::array kNames = {"starting",   "idle",  "enabling", "following",
                                 "quick_stop", "fault", "holding"};
  return kNames.at(static_cast<std::size_t>(phase));
}

}  // namespace mimesis::hw
