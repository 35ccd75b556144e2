#include "common/motion/mocap/c3d_words.h"

#include <bit>
#include <cmath>
#include <limits>

#include "common/error.h"
#include "common/motion/mocap/text_scanner.h"

namespace mimesis::mocap {
namespace {

// VAX F: sign, 8 bits of exponent with bias 128, 23 of a mantissa 0.1f; two words, the high first.
double from_vax(std::uint32_t bits) {
  const int exponent = static_cast<int>(bits >> 23 & 0xFF);
  const bool negative = bits >> 31;
  if (exponent == 0) return negative ? std::numeric_limits<double>::quiet_NaN() : 0.0;
  const double mantissa = static_cast<double>((bits & 0x7FFFFF) | 0x800000);
  return std::ldexp(negative ? -mantissa : mantissa, exponent - 128 - 24);
}

}  // namespace

double C3dWords::f32(std::size_t at) const {
  const std::uint32_t first = u16(at), second = u16(at + 2);
  switch (processor) {
    case C3dProcessor::dec:
      return from_vax(first << 16 | second);
    case C3dProcessor::mips:
      return std::bit_cast<float>(first << 16 | second);
    case C3dProcessor::intel:
      break;
  }
  return std::bit_cast<float>(second << 16 | first);
}

void C3dWords::fail(std::size_t at, const std::string& what) const {
  throw ConfigError(one_line(file + ": byte " + std::to_string(at) + ": " + what));
}

void C3dWords::fail(const std::string& what) const {
  throw ConfigError(one_line(file + ": " + what));
}

}  // namespace mimesis::mocap
