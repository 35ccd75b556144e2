#pragma once
#include <cstdint>
#include <string>

namespace mimesis::tool {

/// "2026-11-21 15:40:00.250 UTC" for wall time, "12.250 s" for simulated time.
std::string human_time(std::uint64_t ns);

}  // namespace mimesis::tool
