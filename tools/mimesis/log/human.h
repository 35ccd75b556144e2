#pragma once
#include <cstdint>
#include <string>

namespace mimesis::tool {

/// "2026-11-21 15:40:00.250 UTC" for wall time, "12.250 s" for simulated time.
std::string human_time(std::uint64_t ns);
/// "257.6 MB".
std::string human_bytes(std::uint64_t bytes);

}  // namespace mimesis::tool
