#pragma once
#include "tools/mimesis/log/play.h"

namespace mimesis::tool {

/// Plays as a member of a lock-step graph. At the end of the log it leaves, or (`stay`) remains,
/// silent: others may still have work. Returns the exit code.
int play_in_lockstep(const PlayOptions& options, Playback& playback);

}  // namespace mimesis::tool
