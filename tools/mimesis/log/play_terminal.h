#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "common/time.h"

namespace mimesis::tool {

enum class PlayKey { kPause, kStep, kBack, kForward, kFaster, kSlower, kQuit };

/// Takes the keys off the front of what a terminal sent; an unfinished escape sequence stays,
/// unknown keys are dropped.
std::vector<PlayKey> take_keys(std::string& typed);

/// While one lives, the terminal on standard input gives single keys without echo. It is restored
/// however the process ends, and while it is suspended. One per process.
class PlayKeys {
 public:
  PlayKeys();
  ~PlayKeys();
  PlayKeys(const PlayKeys&) = delete;
  PlayKeys& operator=(const PlayKeys&) = delete;

  /// Standard input; -1 if it is no terminal, belongs to another job now, or is at its end.
  int fd() const;
  std::vector<PlayKey> read();

 private:
  bool ours_ = false, gone_ = false;
  std::string typed_;
};

/// Contents of the progress line.
struct PlayState {
  double position_s = 0.0, end_s = 0.0;
  double rate = 1.0;  ///< [1]
  bool paused = false, holding = false;
  double mb_s = 0.0;     ///< played lately
  runtime::Time late{};  ///< worst one lately
};

/// "12.3 / 60.0 s  [####      ]  x1  203.1 MB/s  late 0.08 ms  PAUSED"
std::string play_line(const PlayState& state);

/// Draws the progress line on standard error if it is a terminal, ten times a second.
class PlayScreen {
 public:
  using Wall = std::chrono::steady_clock::time_point;

  PlayScreen();
  ~PlayScreen();
  PlayScreen(const PlayScreen&) = delete;
  PlayScreen& operator=(const PlayScreen&) = delete;

  bool shown() const { return shown_; }
  Wall next() const { return next_; }  ///< time to draw again
  void count(runtime::Time late) { late_ = std::max(late_, late); }
  /// `bytes`: played since the start.
  void draw(Wall now, PlayState state, std::uint64_t bytes);
  void clear();

 private:
  bool shown_, drawn_ = false;
  Wall next_{}, since_{};
  std::uint64_t bytes_ = 0;  ///< at since_
  double mb_s_ = 0.0;
  runtime::Time late_{}, worst_{};
};

}  // namespace mimesis::tool
