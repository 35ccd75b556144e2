#pragma once
#include <string>
#include <vector>

#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// As open_logs, but elided payloads (elided_payload.h) are whole: their nodes run again, which is
/// told on standard error. @throws VerbEnd also if that gives other bytes than were recorded.
std::vector<OpenLog> open_whole_logs(const std::vector<std::string>& paths);

}  // namespace mimesis::tool
