#pragma once
#include <functional>
#include <string>
#include <vector>

#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// As open_logs, but elided payloads (elided_payload.h) are whole: their nodes run again, which is
/// told on standard error. `wanted(topic)` tells whose, null: all. `unconfined`: see log replay.
/// @throws VerbEnd also if that gives other
/// bytes than were recorded; ConfigError if the log names a program that it may not.
std::vector<OpenLog> open_whole_logs(const std::vector<std::string>& paths, bool unconfined = false,
                                     const std::function<bool(const std::string&)>& wanted = {});

}  // namespace mimesis::tool
