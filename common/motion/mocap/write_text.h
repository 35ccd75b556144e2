#pragma once
#include <charconv>
#include <string>

#include "common/motion/mocap/skeleton.h"

namespace mimesis::mocap {

/// Appends a number with so many decimals, the same bytes in every locale.
inline void append_fixed(std::string& text, double value, int decimals) {
  char digits[400];
  const auto end =
      std::to_chars(digits, digits + sizeof digits, value, std::chars_format::fixed, decimals);
  text.append(digits, end.ptr);
}

/// Appends the shortest text that reads as the same number.
inline void append_exact(std::string& text, double value) {
  char digits[32];
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

/// That a clip can be written: joints with parents before them, sizes that fit, finite numbers.
/// @throws ConfigError
void check_writable(const Clip& clip);

}  // namespace mimesis::mocap
