#pragma once
#include <string>
#include <vector>

#include "tools/mimesis/log/play_ahead.h"
#include "tools/mimesis/log/playback.h"

namespace mimesis::tool {

struct PlayOptions {
  std::vector<std::string> files;
  PlaybackOptions playback;
  PlayAheadLimits ahead;
  std::string name = "player";  ///< in the graph
  double rate = 1.0;            ///< recorded seconds per second of wall time [1]
  int loops = 1;                ///< 0: until stopped
  bool paused = false;          ///< at the start
  bool stay = false;            ///< at the end: paused, or a silent member of the lock-step
  bool keys = true;             ///< on a terminal
  bool clock = false;           ///< also drive the graph's simulated clock
  bool lockstep = false;        ///< take part in a lock-step graph
  bool json = false;
};

constexpr double kSlowestPlay = 1e-3, kFastestPlay = 1e3;  ///< bounds of the rate [1]

/// `mimesis log play`: publishes the messages of a log on their topics with their types, latched
/// ones first. On the wall clock paced by `rate` (play_paced.h), or in lock-step
/// (lockstep_player.h). Returns the exit code: 0, 1 if something could not be read or reached no
/// subscriber, 3 if a file is not there, 130 if interrupted. @throws ConfigError
int log_play(const PlayOptions& options);

}  // namespace mimesis::tool
