#include "common/runtime/value_text.h"

#include <algorithm>
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

std::optional<bool> to_condition(std::string_view text) {
  const bool inverted = text.starts_with('!');
  auto value = to_bool(text.substr(inverted ? 1 : 0));
  if (value) value = *value != inverted;
  return value;
}

std::optional<double> to_amount(std::string_view text, std::span<const TextUnit> units) {
  const std::size_t split = text.find_last_of("0123456789.");
  if (split == std::string_view::npos) return std::nullopt;
  const auto value = to_double(text.substr(0, split + 1));
  std::string_view name = text.substr(split + 1);
  while (name.starts_with(' ')) name.remove_prefix(1);
  const auto unit = std::ranges::find(units, name, &TextUnit::name);
  if (!value || unit == units.end() || *value < 0.0 || *value * unit->size >= 9e18) {
    return std::nullopt;
  }
  return *value * unit->size;
}

std::optional<std::chrono::nanoseconds> to_duration(std::string_view text) {
  static constexpr TextUnit kUnits[] = {{"ns", 1.0}, {"us", 1e3},   {"ms", 1e6},
                                        {"s", 1e9},  {"min", 6e10}, {"h", 3.6e12}};
  const auto ns = to_amount(text, kUnits);
  return ns ? std::optional(std::chrono::nanoseconds(std::llround(*ns))) : std::nullopt;
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), above(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) above[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = above[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, replaced});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
    std::swap(before, above);
    std::swap(above, row);
  }
  return above[b.size()];
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& known) {
  const std::string* best = nullptr;
  std::size_t best_distance = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (const std::string& candidate : known) {
    std::size_t distance = edit_distance(word, candidate);
    if (distance == 0) continue;  // what was written is no suggestion
    // A forgotten unit ("rate" for "rate_hz") is one slip, however long the unit is.
    if (word.size() >= 3 && candidate.starts_with(word))
      distance = std::min<std::size_t>(distance, 1);
    if (distance < best_distance && distance < word.size()) {
      best = &candidate;
      best_distance = distance;
    }
  }
  return best != nullptr ? ", did you mean '" + *best + "'?" : "";
}

}  // namespace mimesis::runtime
