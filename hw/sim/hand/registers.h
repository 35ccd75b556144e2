#pragma once
#include <array>
#include <cstdint>
#include <string>

/// Register map of a three-finger adaptive gripper like that of the Robotiq 3F, from its manual and
/// not from the profile that the bridge reads it by. Pure. Byte 2k of the manual is the high byte
/// of register k.
namespace mimesis::hw::sim {

inline constexpr int kUnit = 9;                ///< Modbus unit id of the hand
inline constexpr int kOutputAddress = 0x03E8;  ///< first register written (function code 16)
inline constexpr int kInputAddress = 0x07D0;   ///< first register read (function code 3 or 4)
inline constexpr std::size_t kRegisters = 8;   ///< in each direction: 15 bytes, the last unused
using Registers = std::array<std::uint16_t, kRegisters>;

/// Posture of the fingers' bases.
enum class HandMode : std::uint8_t { basic = 0, pinch = 1, wide = 2, scissor = 3 };

/// To the hand. All fingers move together.
struct HandOutput {
  bool activate = false;  ///< rACT; a falling edge resets the hand
  HandMode mode = HandMode::basic;
  bool go = false;            ///< rGTO: move to `position`, else stand still
  std::uint8_t position = 0;  ///< 0 open .. 255 closed
  std::uint8_t speed = 0;     ///< 0 slowest .. 255 fastest
  std::uint8_t force = 0;     ///< 0 weakest .. 255 strongest
  friend bool operator==(const HandOutput&, const HandOutput&) = default;
};

enum class Initialisation : std::uint8_t { reset = 0, activating = 1, changing_mode = 2, done = 3 };
enum class Motion : std::uint8_t { moving = 0, some_stopped = 1, all_stopped = 2, at_request = 3 };
enum class Contact : std::uint8_t {
  none = 0,
  while_opening = 1,
  while_closing = 2,
  at_request = 3
};

/// From the hand.
struct HandInput {
  bool activated = false;  ///< gACT
  HandMode mode = HandMode::basic;
  bool go = false;                                        ///< gGTO
  Initialisation initialisation = Initialisation::reset;  ///< gIMC
  Motion motion = Motion::moving;                         ///< gSTA
  Contact contact = Contact::none;                        ///< gDTA..gDTC: of the fingers
  std::uint8_t fault = 0;                                 ///< gFLT, see fault_text
  std::uint8_t requested = 0;                             ///< echo of the requested position
  std::uint8_t position = 0;                              ///< 0 open .. 255 closed
  /// current of the motors, in tenths of mA
  std::uint8_t current = 0;
  friend bool operator==(const HandInput&, const HandInput&) = default;
};

Registers encode(const HandOutput& output);
HandOutput decode_output(const Registers& registers);
Registers encode(const HandInput& input);

/// Empty for 0, else words and number.
std::string fault_text(std::uint8_t fault);
}  // namespace mimesis::hw::sim
