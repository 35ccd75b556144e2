#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "common/runtime/log.h"

namespace mimesis::runtime {

struct LogLine {
  Level level = Level::info;
  std::string text;
};

/// Name in front of every line of this process on standard error.
void set_log_name(std::string_view name);

/// Keeps one text for topic NODE/log that is too long for standard error: the parameters.
void record(std::string_view text);

/// Lines since the last call, for publication by the node's own thread: a logger may be called
/// anywhere, a socket may not. At most 256 are kept, the newest ones.
std::vector<LogLine> take_log_lines();

}  // namespace mimesis::runtime
