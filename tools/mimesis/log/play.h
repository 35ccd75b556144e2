#pragma once
#include <string>

#include "tools/mimesis/log/playback.h"

namespace mimesis::tool {

struct PlayOptions {
  std::string file;
  PlaybackOptions playback;
  std::string name = "player";   ///< in the graph
  double rate = 1.0;             ///< recorded seconds per second of wall time [1]
  int loops = 1;                 ///< 0: until stopped
  bool clock = false;            ///< also drive the graph's simulated clock
  bool lockstep = false;         ///< take part in a lock-step graph
  double step_rate_hz = 1000.0;  ///< of the player in lock-step
  bool json = false;
};

/// `mimesis log play`: publishes the messages of a log on their topics with their types, latched
/// ones first. On the wall clock paced by `rate`. In lock-step every message appears in the first
/// step of the player at or after its recorded time, so that equal logs give equal runs. Returns
/// the exit code.
int log_play(const PlayOptions& options);

}  // namespace mimesis::tool
