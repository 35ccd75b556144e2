#pragma once
#include <charconv>
#include <chrono>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace mimesis::runtime {

/// Text to values, strictly: the whole text must fit, decimal only, no locale, no octal, no "yes".
std::optional<double> to_double(std::string_view text);  ///< finite numbers only
/// Digits alone, in this base.
template <class Integer>
std::optional<Integer> to_whole(std::string_view text, int base = 10) {
  Integer value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  return error == std::errc{} && end == text.data() + text.size() ? std::optional(value)
                                                                  : std::nullopt;
}
std::optional<int> to_int(std::string_view text);    ///< "010" is nothing: octal or ten?
std::optional<bool> to_bool(std::string_view text);  ///< "true" or "false"
/// Value of an `if`: "true", "false", "!true" or "!false".
std::optional<bool> to_condition(std::string_view text);
/// A number of at least 0 in these units, in the smallest: "1.5 min" -> 90e9 ns; below 9e18.
struct TextUnit {
  std::string_view name;
  double size;
};
std::optional<double> to_amount(std::string_view text, std::span<const TextUnit> units);
/// "2s", "500ms", "1.5 min": not negative; units ns us ms s min h.
std::optional<std::chrono::nanoseconds> to_duration(std::string_view text);

/// Fewest insertions, deletions, replacements and swaps of neighbours that turn `a` into `b`
/// (optimal string alignment). O(|a|·|b|).
std::size_t edit_distance(std::string_view a, std::string_view b);

/// ", did you mean 'k_1_s'?" with the best of `known`, or "" if none is near `word`.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& known);

}  // namespace mimesis::runtime
