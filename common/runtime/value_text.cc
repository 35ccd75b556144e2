#include "common/runtime/value_text.h"

#include <array>
#include <charconv>
#include <cmath>

namespace mimesis::runtime {
namespace {

template <class T>
std::optional<T> number(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

std::optional<double> to_double(std::string_view text) {
  const auto value = number<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<int> to_int(std::string_view text) {
  const std::size_t first = text.find_first_not_of("+-");
  if (first != std::string_view::npos && text[first] == '0' && text.size() > first + 1) {
    return std::nullopt;
  }
  return number<int>(text);
}

std::optional<bool> to_bool(std::string_view text) {
  if (text == "true") return true;
  if (text == "false") return false;
  return std::nullopt;
}

std::optional<std::chrono::nanoseconds> to_duration(std::string_view text) {
  struct Unit {
    std::string_view name;
    double ns;
  };
  static constexpr std::array kUnits = {Unit{"ns", 1.0}, Unit{"us", 1e3},   Unit{"ms", 1e6},
                                        Unit{"s", 1e9},  Unit{"min", 6e10}, Unit{"h", 3.6e12}};
  const std::size_t split = text.find_last_of("0123456789.");
  if (split == std::string_view::npos) return std::nullopt;
  const auto value = to_double(text.substr(0, split + 1));
  std::string_view name = text.substr(split + 1);
  while (name.starts_with(' ')) name.remove_prefix(1);
  for (const Unit& unit : kUnits) {
    if (value && unit.name == name && *value >= 0.0 && *value * unit.ns < 9e18) {
      return std::chrono::nanoseconds(std::llround(*value * unit.ns));
    }
  }
  return std::nullopt;
}

}  // namespace mimesis::runtime
