#pragma once
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/launch/node_host.h"

namespace mimesis::launch {

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

/// How a node fared.
struct NodeOutcome {
  std::string name;
  int exit_code = 0;  ///< exit code of its last run; 128 + signal if it was killed
  int restarts = 0;
  bool killed = false;  ///< did not stop in time
};

struct Outcome {
  int exit_code = 0;
  std::string reason;  ///< why the run ended, empty if it ended as it should
  std::vector<NodeOutcome> nodes;
};

/// Starts the nodes of a graph in order of `after` and readiness, watches them, and stops them in
/// reverse. Single-threaded; sleeps in poll(2) on the ends of processes, their output, signals and
/// the graph's registry. Precondition: SIGINT, SIGTERM and SIGHUP are blocked; the graph was
/// checked.
/// @param end_fd  readable when the run shall end; -1: none
/// @param life    of `keep`
/// @param news    how far the run is, for the progress line; null: nothing is known
using News = std::function<std::string()>;
Outcome supervise(const GraphFile& graph, const Run& run, int end_fd, Fd life, News news = {});

}  // namespace mimesis::launch
