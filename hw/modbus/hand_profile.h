#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/runtime/params.h"

/// What is known of one kind of hand: which registers, what their bits mean, what proves that it is
/// that kind. One file of models/hands holds it; no code knows a maker. Pure.
namespace mimesis::hw::modbus {

/// Posture of the fingers' bases. Logs hold the numbers.
enum class HandMode : std::uint8_t { basic = 0, pinch = 1, other = 2 };

/// Set-point of the hand.
struct HandSetpoint {
  bool move = false;  ///< false: stand still
  HandMode mode = HandMode::basic;
  double closure = 0.0;  ///< 0 open .. 1 closed [1]
  double force = 0.0;    ///< 0 weakest .. 1 strongest [1]
};

struct HandReading {
  bool active = false;  ///< initialised, reachable, without fault
  HandMode mode = HandMode::basic;
  double closure = 0.0;  ///< 0 open .. 1 closed [1]
  bool moving = false;
  bool object_detected = false;  ///< stopped by contact while closing
  std::string fault;             ///< empty, or one line
  std::uint64_t transactions = 0, errors = 0;
};

/// Values by register address.
using HandRegisters = std::map<int, std::uint16_t>;

/// Neighbouring registers that are read or written at once.
struct RegisterBlock {
  int address = -1, count = 0;
  int function = 3;  ///< that reads: 3 or 4

  void visit(runtime::ParamVisitor& v) {
    v("register", address, 0, 65535);
    v("count", count, 1, 120);
    v("function", function, 3, 4);
  }
};

/// Some bits of a register, as a picture of 16 places, the highest bit first; blanks do not count.
///   0, 1  this value     .  any     n  a bit of the number (in all 16: two's complement)
struct RegisterBits {
  int address = -1;
  std::string bits{};
  std::uint16_t mask = 0, value = 0, number = 0;  ///< of the picture; set by HandProfile::check

  void visit(runtime::ParamVisitor& v) {
    v("register", address, 0, 65535);
    v("bits", bits);
  }
};

/// A test of a register: true if the bits are so, with `differs` (key `not`) if they are not.
struct RegisterTest : RegisterBits {
  bool differs = false;
  std::string says{};  ///< what it means, for people
  bool again = false;  ///< of a fault: only a new activation leads out

  void visit(runtime::ParamVisitor& v) {
    RegisterBits::visit(v);
    v("not", differs);
    v("says", says);
    v("again", again);
  }
};

/// A number that runs linearly from `at_0` to `at_1`.
struct RegisterNumber : RegisterBits {
  double at_0 = 0.0, at_1 = 255.0;

  void visit(runtime::ParamVisitor& v) {
    RegisterBits::visit(v);
    v("at_0", at_0, -32768.0, 65535.0);
    v("at_1", at_1, -32768.0, 65535.0);
  }
};

struct HandProfile {
  std::string name;          ///< "three-finger gripper (Robotiq 3F)"
  int unit = 1;              ///< Modbus unit [1]
  int baud_bit_s = 115'200;  ///< of a serial line [bit/s]
  std::string parity = "none";
  double timeout_s = 0.3;                            ///< longest wait for each answer [s]
  std::vector<RegisterBlock> identify, read, write;  ///< read once; in each exchange; when changed

  // set-point -> registers, in this order
  std::vector<RegisterBits> always, activate, basic, pinch;
  std::vector<RegisterNumber> closure, force;
  std::vector<RegisterBits> go, stand;  ///< while it is to move, and while not

  // registers -> reading: true if one of the tests is
  std::vector<RegisterTest> ready;               ///< initialised; none: it always is
  std::vector<RegisterTest> is_basic, is_pinch;  ///< none: it has one mode, the one asked
  std::vector<RegisterTest> moving, object;
  std::vector<RegisterNumber> closed;  ///< the mean of them
  std::vector<RegisterTest> faults;    ///< the first that is true

  // who it is
  std::vector<RegisterTest> contradicts;  ///< one is true: another device
  std::vector<RegisterTest>
      proves;            ///< one has been true: this one; none: what does not contradict
  std::string unproven;  ///< what a device is that is ready and has proved nothing

  void visit(runtime::ParamVisitor& v);
  /// Reads the pictures. @throws ConfigError that names what is wrong: a picture, a register that
  /// is neither read nor written, a hand whose closure is not known
  void check();
};

/// @throws ConfigError that names file and place
HandProfile load_hand_profile(const std::string& file);

/// Set-point to registers: activates the hand, and again after a fault that requires it.
HandRegisters to_registers(const HandProfile& hand, const HandSetpoint& setpoint,
                           const HandRegisters& last);
/// Registers to reading. @param asked mode of the set-point
HandReading to_reading(const HandProfile& hand, const HandRegisters& registers, HandMode asked);
bool is_ready(const HandProfile& hand, const HandRegisters& registers);
/// What shows that this is another device; empty: nothing does.
std::string contradiction(const HandProfile& hand, const HandRegisters& registers);
bool proves(const HandProfile& hand, const HandRegisters& registers);

}  // namespace mimesis::hw::modbus
