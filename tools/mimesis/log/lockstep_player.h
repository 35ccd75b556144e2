#pragma once
#include "tools/mimesis/log/play.h"

namespace mimesis::tool {

/// Plays as a node that steps with the graph. Stays, silent, when the log is at its end: others may
/// still have work. Returns the exit code of the node.
int play_in_lockstep(const PlayOptions& options);

}  // namespace mimesis::tool
