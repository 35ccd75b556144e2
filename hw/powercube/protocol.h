#pragma once
#include <cstdint>
#include <optional>

#include "hw/can/bus.h"

/// Frames of Amtec/Schunk PowerCube modules (M3/M4 protocol, ProtocolCommands.h and m5apiw32.h of
/// Schunk's library): the arm of [M18]. Pure; numbers are little-endian, positions floats in rad.
namespace mimesis::hw::powercube {

inline constexpr int kLastModule = 31;  ///< modules are 1..31

enum class Command : std::uint8_t {
  reset = 0x00,  ///< clears errors and HALTED
  home = 0x01,
  halt = 0x02,  ///< brakes; no motion until reset
  watchdog = 0x07,
  set_parameter = 0x08,
  get_parameter = 0x0A,
  set_motion = 0x0B,
};

enum class Parameter : std::uint8_t {
  state = 0x27,
  config = 0x39,
  position = 0x3C,
  min_position = 0x45,
  max_position = 0x46,
  max_velocity = 0x48,
  max_acceleration = 0x4A,
};

/// Bits of Parameter::state.
namespace state {
inline constexpr std::uint32_t kError = 1u << 0, kHomeOk = 1u << 1, kHalted = 1u << 2,
                               kPowerFault = 1u << 3, kFollowingError = 1u << 4,
                               kCommunication = 1u << 5, kMotion = 1u << 11;
}
inline constexpr std::uint32_t kWatchdogEnabled = 1u << 24;  ///< of Parameter::config
inline constexpr std::uint8_t kNotOk = 1u << 0;  ///< of the short state: error, not homed or halted
inline constexpr std::uint8_t kMoves = 1u << 4;  ///< of the short state

can::Frame to_all(Command command);  ///< reset, halt, watchdog
can::Frame get(int module, Parameter parameter);
can::Frame set(int module, Parameter parameter, std::uint32_t value);
can::Frame set(int module, Parameter parameter, float value);
/// Motion to `position` [rad] over `time_ms`, with an extended answer.
can::Frame step(int module, float position, std::uint16_t time_ms);

/// An answer of a module.
struct Answer {
  int module = 0;
  Command command = Command::reset;
  std::uint8_t parameter = 0;  ///< or mode of motion
  std::uint32_t value = 0;     ///< of a parameter
  float position = 0.0f;       ///< of a motion, or the value as a float [rad]
  std::uint8_t short_state = 0;
};
/// Nothing if it is no answer, or not one of those above.
std::optional<Answer> parse_answer(const can::Frame& frame);

}  // namespace mimesis::hw::powercube
