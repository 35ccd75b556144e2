#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "tools/mimesis/log/play_lateness.h"

namespace mimesis::tool {

/// What a player tells at its end.
struct PlayReport {
  std::vector<std::string> files;
  std::uint64_t messages = 0, bytes = 0;  ///< played
  std::uint64_t missed = 0;               ///< messages that a reliable subscriber did not take
  int passes = 1;
  runtime::Time going{};                   ///< wall time without pauses
  runtime::Time held{};                    ///< waited for slow subscribers
  const PlayLateness* lateness = nullptr;  ///< not null
};

std::string play_json(const PlayReport& report);
/// Lines for people.
std::string play_text(const PlayReport& report);

}  // namespace mimesis::tool
