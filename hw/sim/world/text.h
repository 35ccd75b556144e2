#pragma once
#include <cmath>
#include <cstdlib>
#include <string>

namespace mimesis::world {

/// Length [m] for people: "34.2 mm".
inline std::string millimetres(double m) {
  const long tenths = std::lround(m * 1e4);
  return std::to_string(tenths / 10) + "." + std::to_string(std::labs(tenths % 10)) + " mm";
}

}  // namespace mimesis::world
