#pragma once
#include <algorithm>
#include <chrono>
#include <deque>
#include <optional>
#include <string>
#include <string_view>

#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {

/// Copies the standard output and error of a node line by line to a file, and with the node's
/// name in front to our standard error. Bounded: a line of more than 4 KiB is broken, the file ends
/// at 64 MiB.
class LineLog {
 public:
  /// @throws std::runtime_error if the file cannot be opened.
  LineLog(const std::string& name, const std::string& file);

  /// Takes the readable bytes (at most 256 KiB, so that others get their turn); closes `from` at
  /// its end.
  void pump(Fd& from, std::string& partial);
  /// Streams of one child; their lines do not mix.
  void pump(Child& child);
  /// Writes out a last line without its end.
  void flush();
  /// The last line on standard error, empty before there is one: often the reason why a node ended.
  const std::string& last_error() const { return last_error_; }

 private:
  void take(std::string& partial);
  void line(std::string_view text);

  std::string prefix_;
  Fd file_;
  std::size_t written_ = 0;
  std::string out_, err_;  // begun lines
  std::string last_error_;
};

using WallTime = std::chrono::steady_clock::time_point;

/// When a failed node may be started again: a delay that grows with every restart in the window.
class Backoff {
 public:
  explicit Backoff(const Restart& restart) : restart_(restart) {}
  /// Time of the next start after a failure at `now`; nothing if it has failed too often.
  std::optional<WallTime> next(WallTime now);

 private:
  Restart restart_;
  std::deque<WallTime> restarts_;  // within the window
};

/// One node of a run: its process, its output, and where it stands.
class ManagedNode {
 public:
  enum class State {
    waiting,   ///< for those it comes after
    starting,  ///< runs, is not ready
    ready,
    delayed,   ///< failed, will be started again at `due`
    stopping,  ///< was asked to stop, will be killed at `due`
    ended,
  };

  ManagedNode(const NodeSpec& spec, Command command, const std::string& log_file);

  /// @throws std::runtime_error if it cannot be started.
  void start(WallTime now);
  void set_ready();
  /// Asks it to stop; `due` is `timeout` later.
  void stop(WallTime now, std::chrono::nanoseconds timeout);
  void kill();
  /// Reads its output, and its ending if it has one.
  std::optional<Ending> poll();
  /// Decides what follows an ending: `delayed` or `ended`.
  void ended(const Ending& ending, WallTime now);

  bool alive() const { return child_.pid > 0; }
  const Child& child() const { return child_; }
  const NodeSpec& spec() const { return spec_; }
  const std::string& name() const { return spec_.name.text; }
  State state() const { return state_; }
  void give_up() { state_ = State::ended; }  ///< will not be started (again)
  void hurry(WallTime due) { due_ = std::min(due_, due); }
  WallTime due() const { return due_; }  ///< end of the states starting, delayed and stopping
  WallTime started() const { return started_; }
  bool was_ready() const { return was_ready_; }
  bool killed() const { return killed_; }
  int restarts() const { return restarts_; }
  const std::optional<Ending>& ending() const { return ending_; }
  const std::string& last_error() const { return log_.last_error(); }

 private:
  NodeSpec spec_;
  Command command_;
  LineLog log_;
  Child child_;
  Backoff backoff_;
  State state_ = State::waiting;
  WallTime due_{}, started_{};
  bool was_ready_ = false, killed_ = false;
  int restarts_ = 0;
  std::optional<Ending> ending_;
};

}  // namespace mimesis::launch
