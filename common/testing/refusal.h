#pragma once
#include <string>

#include "common/error.h"

namespace mimesis::testing {

/// The words with which `act()` refuses bad configuration; `accepted` if it does not.
template <class Act>
std::string refusal(const Act& act, const char* accepted = "") {
  try {
    act();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return accepted;
}

}  // namespace mimesis::testing
