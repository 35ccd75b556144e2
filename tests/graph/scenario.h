#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/testing/process.h"

namespace mimesis::testing {

/// Options of the imitation without cameras and vision, which are most of its time: vision's
/// symbols and the robot's table are played from tests/graph/symbols/NAME.mcap
/// (tests/replay/record).
std::vector<std::string> played(const std::string& name, std::vector<std::string> options = {});

/// A scenario of launch/ in a graph of its own, with a log in a temporary folder.
class Scenario {
 public:
  /// `options` of `mimesis launch`.
  explicit Scenario(const std::string& name, std::vector<std::string> options = {});
  ~Scenario();

  Process& process() { return *process_; }
  const TestGraph& graph() const { return graph_; }
  const std::string& log() const { return log_; }

  /// Waits for the end. Exit code, or nothing after four minutes of a quiet machine.
  std::optional<int> wait() { return process_->wait(240s); }
  /// Last line of standard output.
  nlohmann::json result() const;
  struct Logged {
    std::uint64_t time_ns;  ///< graph time
    std::string payload;
    bool operator==(const Logged&) const = default;
  };
  /// All messages on `topic` in the log, in order.
  std::vector<Logged> messages(const std::string& topic) const;
  /// Process of a node that runs; -1 if there is none of this name.
  pid_t pid(const std::string& node) const;

 private:
  TestGraph graph_;
  std::string folder_, log_;
  std::unique_ptr<Process> process_;
};

}  // namespace mimesis::testing
