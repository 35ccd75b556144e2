#pragma once
#include <string>

#include "common/runtime/value_text.h"

namespace mimesis::tool {

/// For CLI::Option::check: the error, or empty. CLI11's own PositiveNumber answers "abc" with the
/// 309 digits of the largest double.
inline std::string number_above_zero(const std::string& text) {
  const auto number = runtime::to_double(text);
  return number && *number > 0.0 ? "" : "expected a number above 0, found '" + text + "'";
}

inline std::string number_not_below_zero(const std::string& text) {
  const auto number = runtime::to_double(text);
  return number && *number >= 0.0 ? "" : "expected 0 or more, found '" + text + "'";
}

}  // namespace mimesis::tool
