#pragma once
#include <chrono>
#include <string>

#include "tools/mimesis/launch/command.h"

namespace mimesis::launch {

/// What a program that ran to its end has said.
struct Captured {
  int exit_code = 1;
  std::string err;  ///< standard error, at most 64 KiB
};

/// Runs `command`; kills it after `timeout`.
Captured capture(const Command& command, std::chrono::milliseconds timeout);

}  // namespace mimesis::launch
