#pragma once
#include <chrono>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {

/// Runs `work` in a child process and stays its parent, so that nothing can outlive a launch:
///  - kill -9 of this process: the child gets SIGTERM and stops its nodes in order;
///  - kill -9 of the child: this process inherits all that the child had started (it is a
///    subreaper), sends SIGTERM, and after 3 s SIGKILL;
///  - a child that hangs is named, and killed when it has given no sign of life for 2 s.
/// SIGINT, SIGTERM and SIGHUP are passed on. Returns the exit code of `work`, 1 if it was killed:
/// then `killed` says why in its stead, when all it had started is gone.
/// In the child it returns, too, with the result of `work`.
/// @param work  gets the descriptor that it gives its signs of life on: a byte ten times a second.
///              It is watched from the first to the closing.
int keep(const std::function<int(Fd life)>& work,
         const std::function<void(const std::string& why)>& killed);

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

/// Removes what killed nodes have left in a graph's folder: entries, sockets that no process has
/// bound (of simulated devices too), and folders that are empty then.
void clean_folder(const std::string& directory);

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
