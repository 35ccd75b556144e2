#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace mimesis::tool {

/// "500MB", "1.5 GB", "2GiB", "4096": bytes. Units B kB MB GB TB (powers of 1000), KiB MiB GiB TiB;
/// strictly, the whole text must fit.
std::optional<std::uint64_t> to_bytes(std::string_view text);

/// "999 B", "45.2 MB": for people.
std::string bytes_text(std::uint64_t bytes);

/// "2026-11-21 15:40:00.250 UTC" for wall time, "12.250 s" for simulated time.
std::string human_time(std::uint64_t ns);

}  // namespace mimesis::tool
