#pragma once
#include <stdlib.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/mimesis/log/replay_compare.h"
#include "tools/mimesis/stop_signals.h"

namespace mimesis::tool {

struct ReplayOptions {
  std::vector<std::string> nodes;  ///< empty: all nodes with complete records in the logs
  std::vector<std::string> logs;
  /// a program, or a folder of programs, instead of the recorded one
  std::string program;
  std::vector<std::string> sets;  ///< KEY=VALUE
  bool unconfined = false;        ///< programs may write, and open devices and sockets
  double tolerance = 0.0;         ///< see ReplayCompare
  /// Used instead if this machine does not compute as the one that recorded (arithmetic.h).
  std::optional<double> tolerance_elsewhere;
  std::string tolerance_note;     ///< chosen one of two, and why; for the report
  double timeout_s = 60.0;        ///< wall time for a step
  std::uint64_t differences = 1;  ///< shown at most; then a replay stops
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

/// The result of one replay.
struct ReplayReport {
  ReplayResult result = ReplayResult::equal;
  ReplayCounts counts;
  double graph_s = 0.0, wall_s = 0.0;
  std::uint64_t difference_count = 0;
  std::vector<ReplayDifference> differences;  ///< those to be shown
  std::string problem;                        ///< reason why it did not come to its end
  std::vector<std::string> notes;             ///< further lines for the reader
  Tolerated tolerated;
};

/// Called with the log time read so far [ns].
using ReplayProgress = std::function<void(std::uint64_t log_time_ns)>;

/// A new folder that is removed with this object.
class TemporaryFolder {
 public:
  /// @throws std::runtime_error if it cannot be made
  TemporaryFolder()
      : path_((std::filesystem::temp_directory_path() / "mimesis-replay-XXXXXX").string()) {
    if (mkdtemp(path_.data()) != nullptr) return;
    throw std::runtime_error(path_ + ": " + std::strerror(errno));
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_, ignored_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  std::error_code ignored_;
};

}  // namespace mimesis::tool
