#pragma once
#include <sys/types.h>

#include <chrono>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "tools/mimesis/launch/process.h"
#include "tools/mimesis/log/replay_life.h"
#include "tools/mimesis/log/temporary_folder.h"
#include "tools/mimesis/stop_signals.h"

namespace mimesis::tool {

/// A program of a node, run step by step (common/runtime/replay.h). Ends with this object.
class ReplayNode {
 public:
  /// @param program  path; its parameters are those of `life`, then `sets` (KEY=VALUE)
  /// @param timeout_s  of wall time, for each step and the end
  /// @throws std::runtime_error if it cannot be started.
  ReplayNode(const std::string& program, const Life& life, const std::vector<std::string>& sets,
             double timeout_s);
  ~ReplayNode();
  ReplayNode(const ReplayNode&) = delete;
  ReplayNode& operator=(const ReplayNode&) = delete;

  /// What the node did, or why it is no longer there (one line, then the last lines it wrote).
  /// Fails with an empty reason if `stop` was requested meanwhile.
  tl::expected<v1::ReplayOutcome, Status> run(const v1::ReplayStep& step, const StopSignals& stop);
  /// There are no more steps: the node ends. What was wrong with that, or nothing.
  std::string finish();
  /// A step or the end took too long: why `run` or `finish` failed. The node was killed.
  bool timed_out() const { return timed_out_; }

 private:
  bool wait_for_outcome(const StopSignals& stop);
  launch::Ending wait();
  std::string ending();
  std::string too_long(std::string_view what) const;
  std::string describe(const launch::Ending& how) const;
  std::string last_words() const;

  TemporaryFolder folder_;  ///< for the parameters
  launch::Fd socket_;
  launch::Fd words_;  ///< what it writes to standard output and error
  launch::Fd pidfd_;
  pid_t pid_ = -1;
  std::chrono::milliseconds timeout_;
  bool answered_ = false, timed_out_ = false;
};

}  // namespace mimesis::tool
