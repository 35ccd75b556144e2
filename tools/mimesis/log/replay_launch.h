#pragma once
#include <vector>

#include "tools/mimesis/log/replay.h"

namespace mimesis::tool {

/// Runs the launch file of a recorded lock-step run again, in a graph of its own, and compares
/// every message with the log as it comes. Returns the exit code. @throws ConfigError
int replay_launch(const std::vector<OpenLog>& logs, const ReplayOptions& options,
                  const StopSignals& stop);

}  // namespace mimesis::tool
