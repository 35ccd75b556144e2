#include "hw/powercube/protocol.h"

#include <bit>

#include "common/error.h"
#include "hw/cia402/canopen.h"

namespace mimesis::hw::powercube {
namespace {

using can::Frame;
using cia402::append;

constexpr std::uint32_t kAnswerId = 0x0A0, kGetId = 0x0C0, kSetId = 0x0E0, kAllId = 0x100;
constexpr std::uint8_t kStepExtended = 0x10;  // FSTEP with extended answer

Frame frame(std::uint32_t base, int module, Command command) {
  MIMESIS_ASSERT(module >= 0 && module <= kLastModule);
  return {.id = base + static_cast<std::uint32_t>(module),
          .length = 1,
          .data = {static_cast<std::uint8_t>(command)}};
}

}  // namespace

Frame to_all(Command command) { return frame(kAllId, 0, command); }

Frame get(int module, Parameter parameter) {
  Frame f = frame(kGetId, module, Command::get_parameter);
  append(f, static_cast<std::uint32_t>(parameter), 1);
  return f;
}

Frame set(int module, Parameter parameter, std::uint32_t value) {
  Frame f = frame(kSetId, module, Command::set_parameter);
  append(f, static_cast<std::uint32_t>(parameter), 1);
  append(f, value, 4);
  return f;
}
Frame set(int module, Parameter parameter, float value) {
  return set(module, parameter, std::bit_cast<std::uint32_t>(value));
}

Frame step(int module, float position, std::uint16_t time_ms) {
  Frame f = frame(kSetId, module, Command::set_motion);
  append(f, kStepExtended, 1);
  append(f, std::bit_cast<std::uint32_t>(position), 4);
  append(f, time_ms, 2);
  return f;
}

std::optional<Answer> parse_answer(const Frame& f) {
  if (f.id <= kAnswerId || f.id > kAnswerId + kLastModule || f.length < 2) return std::nullopt;
  Answer answer{.module = static_cast<int>(f.id - kAnswerId),
                .command = static_cast<Command>(f.data[0])};
  switch (answer.command) {
    case Command::reset:
    case Command::home:
    case Command::halt:
      return answer;
    case Command::set_parameter:
      answer.parameter = f.data[1];
      return answer;
    case Command::get_parameter:
      if (f.length != 6) return std::nullopt;
      answer.parameter = f.data[1];
      answer.value = cia402::unsigned_at(f, 2, 4).value_or(0);
      answer.position = std::bit_cast<float>(answer.value);
      return answer;
    case Command::set_motion:
      if (f.length != 8 || f.data[1] != kStepExtended) return std::nullopt;
      answer.parameter = f.data[1];
      answer.position = std::bit_cast<float>(cia402::unsigned_at(f, 2, 4).value_or(0));
      answer.short_state = f.data[6];
      return answer;
    default:
      return std::nullopt;
  }
}

}  // namespace mimesis::hw::powercube
