#include "hw/sim/hand/registers.h"

#include <utility>

namespace mimesis::hw::sim {
namespace {

constexpr std::size_t kFingers = 4;  // A, B, C and the scissor axis
using Bytes = std::array<std::uint8_t, 2 * kRegisters>;

Registers pack(const Bytes& bytes) {
  Registers registers{};
  for (std::size_t i = 0; i < kRegisters; ++i) {
    registers[i] = static_cast<std::uint16_t>(bytes[2 * i] << 8 | bytes[2 * i + 1]);
  }
  return registers;
}

Bytes unpack(const Registers& registers) {
  Bytes bytes{};
  for (std::size_t i = 0; i < kRegisters; ++i) {
    bytes[2 * i] = static_cast<std::uint8_t>(registers[i] >> 8);
    bytes[2 * i + 1] = static_cast<std::uint8_t>(registers[i] & 0xFF);
  }
  return bytes;
}

std::uint8_t byte(unsigned value) { return static_cast<std::uint8_t>(value); }
unsigned flag(bool set, int bit) { return set ? 1u << bit : 0u; }
bool bit(std::uint8_t value, int n) { return (value >> n & 1) != 0; }
unsigned two_bits(std::uint8_t value, int lowest) { return value >> lowest & 3u; }

}  // namespace

Registers encode(const HandOutput& o) {
  Bytes b{};
  b[0] = byte(flag(o.activate, 0) | static_cast<unsigned>(o.mode) << 1 | flag(o.go, 3));
  b[3] = o.position;  // position of finger A; the others follow it while rICF (byte 1, bit 2) is 0
  b[4] = o.speed;
  b[5] = o.force;
  return pack(b);
}

HandOutput decode_output(const Registers& registers) {
  const Bytes b = unpack(registers);
  return {.activate = bit(b[0], 0),
          .mode = static_cast<HandMode>(two_bits(b[0], 1)),
          .go = bit(b[0], 3),
          .position = b[3],
          .speed = b[4],
          .force = b[5]};
}

Registers encode(const HandInput& i) {
  Bytes b{};
  b[0] = byte(flag(i.activated, 0) | static_cast<unsigned>(i.mode) << 1 | flag(i.go, 3) |
              static_cast<unsigned>(i.initialisation) << 4 | static_cast<unsigned>(i.motion) << 6);
  b[1] = byte(static_cast<unsigned>(i.contact) * 0b010101u |
              static_cast<unsigned>(Contact::at_request) << 6);
  b[2] = i.fault;
  for (std::size_t finger = 0; finger < kFingers - 1; ++finger) {
    b[3 + 3 * finger] = i.requested;
    b[4 + 3 * finger] = i.position;
    b[5 + 3 * finger] = i.current;
  }
  return pack(b);
}

std::string fault_text(std::uint8_t fault) {
  constexpr std::array<std::pair<std::uint8_t, const char*>, 10> kTexts = {
      {{0x0, ""},
       {0x5, "action delayed: activation must be completed (0x5)"},
       {0x6, "action delayed: mode change must be completed (0x6)"},
       {0x7, "must be activated first (0x7)"},
       {0x9, "communication chip not ready (0x9)"},
       {0xA, "mode change impeded for less than 20 s (0xA)"},
       {0xB, "automatic release in progress (0xB)"},
       {0xD, "activation failed (0xD)"},
       {0xE, "mode change failed (0xE)"},
       {0xF, "automatic release completed (0xF)"}}};
  for (const auto& [number, text] : kTexts) {
    if (number == fault) return text;
  }
  return "fault " + std::to_string(fault);
}

}  // namespace mimesis::hw::sim
