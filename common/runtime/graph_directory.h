#pragma once
#include <cstdint>
#include <string>
#include <string_view>

namespace mimesis::runtime {

/// @throws ConfigError unless `name` is 1-64 letters, digits, `_`, `-` or `.` and does not begin
/// with `.`: it becomes a file name. `what`: "node name", "graph name".
void check_name(std::string_view what, std::string_view name);

/// @throws ConfigError unless `topic` is names (check_name) joined by `/`.
void check_topic(std::string_view topic);

/// Random, never 0.
std::uint64_t new_start_id();

}  // namespace mimesis::runtime
