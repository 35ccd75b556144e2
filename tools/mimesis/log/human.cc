#include "tools/mimesis/log/human.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

namespace mimesis::tool {
namespace {
constexpr std::uint64_t kYear2000 = 946684800ull * 1'000'000'000;  // later ones are wall time
}

std::string human_time(std::uint64_t ns) {
  if (ns < kYear2000) return fmt::format("{:.3f} s", static_cast<double>(ns) * 1e-9);
  const auto whole = static_cast<std::time_t>(ns / 1'000'000'000);
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03} UTC", fmt::gmtime(whole), ns / 1'000'000 % 1000);
}

}  // namespace mimesis::tool
