#pragma once
#include <sstream>
#include <string>

namespace mimesis::crowd {

/// Words and numbers in one line; numbers with four digits.
template <class... Part>
std::string say(const Part&... part) {
  std::ostringstream out;
  out.precision(4);
  (out << ... << part);
  return out.str();
}

}  // namespace mimesis::crowd
