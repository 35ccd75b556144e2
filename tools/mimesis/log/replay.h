#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/mimesis/log/replay_step.h"
#include "tools/mimesis/stop_signals.h"

namespace mimesis::tool {

struct ReplayOptions {
  std::vector<std::string> nodes;  ///< empty: all that the logs tell enough of
  std::vector<std::string> logs;
  std::string launch;             ///< a launch file to run again instead of single nodes
  std::string program;            ///< or a folder of programs, instead of the recorded one
  std::vector<std::string> sets;  ///< KEY=VALUE; for a launch file NODE.KEY=VALUE
  std::vector<std::string> args;  ///< NAME=VALUE of the launch file's arguments
  double tolerance = 0.0;         ///< see ReplayCompare
  /// Instead, if this machine does not compute as the one that recorded (arithmetic.h).
  std::optional<double> tolerance_elsewhere;
  std::string tolerance_note;     ///< which of the two counts, and why; for the report
  double timeout_s = 60.0;        ///< of wall time, for a step; with a launch file between messages
  std::uint64_t differences = 1;  ///< so many are shown, then a replay stops
  std::uint64_t repeat = 1;
  bool json = false;
};

enum class ReplayResult {
  equal,
  different,
  incomplete,   ///< equal as far as it went, but something needed is not there
  timed_out,    ///< a step did not end
  interrupted,  ///< by a signal
};

/// One replay of one life.
struct LifeReport {
  ReplayResult result = ReplayResult::equal;
  ReplayCounts counts;
  double graph_s = 0.0, wall_s = 0.0;
  std::uint64_t difference_count = 0;
  std::vector<ReplayDifference> differences;  ///< those to be shown
  std::string problem;                        ///< why it did not come to its end
  std::vector<std::string> notes;             ///< what else to know
  Tolerated tolerated;
};

/// Several replays of the same.
struct RunCount {
  std::uint64_t runs = 0, equal = 0;
  LifeReport shown;  ///< of the first that was not equal, else the last one
};

/// Until `runs` were made or one was interrupted.
RunCount repeat(std::uint64_t runs, const std::function<LifeReport()>& replay);

/// Runs a life again: `program` steps with what the recorded one took, and all it does is compared.
/// `progress`: log time read so far [ns].
LifeReport replay_life(const std::vector<OpenLog>& logs, const Life& life,
                       const std::string& program, const ReplayOptions& options,
                       const StopSignals& stop,
                       const std::function<void(std::uint64_t log_time_ns)>& progress);

/// The exit code; not for one that was interrupted.
int exit_code_of(ReplayResult result);

/// `mimesis log replay`. Returns the exit code. @throws ConfigError
int log_replay(const ReplayOptions& options);

}  // namespace mimesis::tool
