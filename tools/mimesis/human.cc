#include "tools/mimesis/human.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "common/runtime/value_text.h"

namespace mimesis::tool {

std::optional<std::uint64_t> to_bytes(std::string_view text) {
  static constexpr runtime::TextUnit kUnits[] = {
      {"", 1.0},    {"B", 1.0},      {"kB", 1e3},        {"MB", 1e6},     {"GB", 1e9},
      {"TB", 1e12}, {"KiB", 1024.0}, {"MiB", 1048576.0}, {"GiB", 0x1p30}, {"TiB", 0x1p40}};
  const auto bytes = runtime::to_amount(text, kUnits);
  return bytes ? std::optional(static_cast<std::uint64_t>(std::llround(*bytes))) : std::nullopt;
}

std::string bytes_text(std::uint64_t bytes) {
  static constexpr std::array kNames = {"kB", "MB", "GB", "TB"};
  if (bytes < 1000) return fmt::format("{} B", bytes);
  auto value = static_cast<double>(bytes) / 1e3;
  std::size_t name = 0;
  for (; value >= 999.95 && name + 1 < kNames.size(); ++name) value /= 1e3;
  return fmt::format("{:.1f} {}", value, kNames[name]);
}

std::string human_time(std::uint64_t ns) {
  constexpr std::uint64_t kYear2000 = 946684800ull * 1'000'000'000;  // later ones are wall time
  if (ns < kYear2000) return fmt::format("{:.3f} s", static_cast<double>(ns) * 1e-9);
  const auto whole = static_cast<std::time_t>(ns / 1'000'000'000);
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03} UTC", fmt::gmtime(whole), ns / 1'000'000 % 1000);
}

}  // namespace mimesis::tool
