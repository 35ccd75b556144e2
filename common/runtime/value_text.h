#pragma once
#include <chrono>
#include <optional>
#include <string_view>

namespace mimesis::runtime {

/// Text to values, strictly: the whole text must fit, decimal only, no locale, no octal, no "yes".
std::optional<double> to_double(std::string_view text);  ///< finite numbers only
std::optional<int> to_int(std::string_view text);        ///< "010" is nothing: octal or ten?
std::optional<bool> to_bool(std::string_view text);      ///< "true" or "false"
/// "2s", "500ms", "1.5 min": not negative; units ns us ms s min h.
std::optional<std::chrono::nanoseconds> to_duration(std::string_view text);

}  // namespace mimesis::runtime
