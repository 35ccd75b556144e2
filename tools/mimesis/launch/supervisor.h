#pragma once
#include <memory>
#include <string>
#include <vector>

#include "tools/mimesis/launch/command.h"

namespace mimesis::launch {

/// Something that can end a run from outside the nodes: the watcher of the result.
class RunEnd {
 public:
  virtual ~RunEnd() = default;
  virtual int fd() const = 0;  ///< readable when the run shall end
};

/// How a node fared.
struct NodeOutcome {
  std::string name;
  int exit_code = 0;  ///< of its last run; 128 + signal if it was killed
  int restarts = 0;
  bool killed = false;  ///< did not stop in time
};

struct Outcome {
  int exit_code = 0;
  std::string reason;  ///< why the run ended, empty if it ended as it should
  std::vector<NodeOutcome> nodes;
};

/// Starts the nodes of a graph in order of `after` and readiness, watches them, stops them in
/// reverse. Single-threaded; sleeps in poll(2) on the ends of processes, their output, signals and
/// the graph's registry.
class Supervisor {
 public:
  /// Precondition: SIGINT, SIGTERM and SIGHUP are blocked; the graph was checked.
  Supervisor(const GraphFile& graph, const Run& run, RunEnd* end);
  ~Supervisor();
  Outcome run();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mimesis::launch
