#include "hw/udp/packet.h"

#include <bit>
#include <cmath>
#include <cstring>

namespace mimesis::hw::udp {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::string_view kCommand = "MJC1", kState = "MJS1";
constexpr std::size_t kHead = 24;
constexpr std::size_t kMostJoints = 64;

template <class Number>
void put(std::string& out, Number number) {
  char bytes[sizeof number];
  std::memcpy(bytes, &number, sizeof number);
  out.append(bytes, sizeof number);
}

template <class Number>
Number get(std::string_view bytes, std::size_t at) {
  Number number;
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}

}  // namespace

const char* name(Condition condition) {
  switch (condition) {
    case Condition::off:
      return "off";
    case Condition::enabling:
      return "enabling";
    case Condition::follows:
      return "following";
    case Condition::stopping:
      return "stopping";
    case Condition::fault:
      return "in fault";
  }
  return "?";
}

std::string encode(const Command& command) {
  std::string out(kCommand);
  put(out, command.header.session);
  put(out, command.header.sequence);
  put(out, command.header.heard);
  put(out, static_cast<std::uint8_t>(command.order));
  put(out, static_cast<std::uint8_t>(command.position_rad.size()));
  put(out, command.watchdog_ms);
  put(out, command.header.other_session);
  for (const double q : command.position_rad) put(out, q);
  for (const double v : command.velocity_rad_s) put(out, v);
  return out;
}

std::optional<State> decode_state(std::string_view bytes) {
  if (bytes.size() < kHead || !bytes.starts_with(kState)) return std::nullopt;
  const std::size_t n = get<std::uint8_t>(bytes, 17);
  const auto condition = get<std::uint8_t>(bytes, 16);
  const bool known = condition <= static_cast<std::uint8_t>(Condition::fault);
  if (n == 0 || n > kMostJoints || bytes.size() != kHead + 24 * n || !known) return std::nullopt;
  if (get<std::uint32_t>(bytes, 4) == 0) return std::nullopt;  // no session
  State state{.header = {.session = get<std::uint32_t>(bytes, 4),
                         .sequence = get<std::uint32_t>(bytes, 8),
                         .heard = get<std::uint32_t>(bytes, 12),
                         .other_session = get<std::uint32_t>(bytes, 20)},
              .condition = static_cast<Condition>(condition),
              .fault = get<std::uint16_t>(bytes, 18)};
  std::size_t at = kHead;
  for (auto* list : {&state.position_rad, &state.velocity_rad_s, &state.torque_n_m}) {
    for (std::size_t i = 0; i < n; ++i, at += 8) {
      list->push_back(get<double>(bytes, at));
      if (!std::isfinite(list->back())) return std::nullopt;
    }
  }
  return state;
}

}  // namespace mimesis::hw::udp
