#pragma once
#include <string>

#include "common/error.h"

namespace mimesis::mocap {

/// What a call refuses its input with, "" if it takes it.
template <typename Call>
std::string message_of(const Call& call) {
  try {
    call();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

}  // namespace mimesis::mocap
