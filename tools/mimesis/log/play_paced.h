#pragma once
#include <optional>
#include <string>

#include "common/runtime/stop_signal.h"
#include "proto/player.pb.h"
#include "tools/mimesis/log/play.h"
#include "tools/mimesis/log/play_bell.h"
#include "tools/mimesis/log/play_keys.h"
#include "tools/mimesis/log/play_lateness.h"
#include "tools/mimesis/log/play_output.h"
#include "tools/mimesis/log/play_screen.h"
#include "tools/mimesis/log/play_timeline.h"

namespace mimesis::tool {

/// Plays on the wall clock; steered by services (play_services.h), by keys, and by signals. Neither
/// late nor slow subscribers change what is played: who subscribes reliably is waited for, and
/// recorded time waits, too.
class PacedPlayer {
 public:
  PacedPlayer(const PlayOptions& options, Playback& playback);

  /// Until the end or a signal; the exit code.
  int run();

  using Done = tl::expected<void, Status>;
  Done pause();
  Done resume();
  /// Pauses and plays one message, or all up to the next one of `topic`.
  Done step(const std::string& topic);
  Done seek(double position_s);
  Done seek(std::uint64_t log_time_ns);
  Done seek_by(double offset_s);
  Done set_rate(double rate);
  v1::PlayerStatus status();

 private:
  using Wall = PlayTimeline::Wall;
  bool running() const { return !quit_ && !stop_signal_.requested(); }
  void await_subscribers();
  void await_read_ahead();
  void jump(std::uint64_t log_time_ns);
  void go();
  void halt();
  bool next_pass();
  void play_pass();
  void play(const Played& message);
  void breathe();
  void hold_for_slow();
  void wait_for(const Played* next);
  void wait_until(Wall wall);
  void press(PlayKey key);
  void tell_clock();
  void draw();
  void last_words();
  int report();
  std::uint64_t position_ns() const;

  PlayOptions options_;
  Playback& playback_;
  runtime::StopSignal stop_signal_;
  PlayBell bell_;
  PlayAhead ahead_;
  runtime::ZmqBus bus_;
  PlayOutput output_;
  PlayTimeline timeline_;
  std::optional<PlayKeys> keys_;
  PlayScreen screen_;
  PlayLateness lateness_;

  bool paused_, quit_ = false, given_up_ = false;
  bool holding_ = true;  ///< time stands, whatever is asked for: subscribers are not there yet
  std::optional<std::string> step_to_;  ///< play up to a message of this topic; empty: of any
  std::string last_topic_;
  int pass_ = 1;
  std::uint64_t messages_ = 0, unserved_ = 0, unserved_bytes_ = 0;
  Wall next_clock_{}, going_since_{};
  runtime::Time going_{}, held_{};
};

}  // namespace mimesis::tool
