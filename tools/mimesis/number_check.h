#pragma once
#include <CLI/Validators.hpp>
#include <string>

#include "common/runtime/value_text.h"

namespace mimesis::tool {

/// For options. CLI11's own PositiveNumber answers "abc" with the 309 digits of the largest double.
inline CLI::Validator number_above_zero() {
  return {[](std::string& text) {
            const auto number = runtime::to_double(text);
            return number && *number > 0.0 ? "" : "expected a number above 0, found '" + text + "'";
          },
          "above 0"};
}

inline CLI::Validator number_not_below_zero() {
  return {[](std::string& text) {
            const auto number = runtime::to_double(text);
            return number && *number >= 0.0 ? "" : "expected 0 or more, found '" + text + "'";
          },
          "0 or more"};
}

}  // namespace mimesis::tool
