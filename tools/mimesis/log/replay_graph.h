#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/raw.h"
#include "tools/mimesis/launch/process.h"
#include "tools/mimesis/log/temporary_folder.h"

namespace mimesis::tool {

/// A graph that `mimesis launch` runs, every message of which is heard. It and what it wrote end
/// with this object.
class ReplayGraph {
 public:
  /// @param accept  topics that are wanted
  /// @throws std::runtime_error if it cannot be started.
  ReplayGraph(const std::string& launch_file, const std::vector<std::string>& args,
              const std::vector<std::string>& sets, bool takes_log,
              std::function<bool(const std::string& topic)> accept);
  ~ReplayGraph();
  ReplayGraph(const ReplayGraph&) = delete;
  ReplayGraph& operator=(const ReplayGraph&) = delete;

  /// Next message; nothing after `timeout`.
  std::optional<runtime::Tapped> next(std::chrono::milliseconds timeout);
  /// How the launch ended, once it has.
  const std::optional<launch::Ending>& ending();
  /// The last lines that it wrote.
  const std::string& words() const { return words_; }

 private:
  void read_words();

  TemporaryFolder folder_;  ///< for the run's own logs
  std::string graph_;
  std::string directory_;  ///< of the graph's sockets
  std::unique_ptr<runtime::Tap> tap_;
  launch::Child child_;
  std::optional<launch::Ending> ending_;
  std::string words_;
};

}  // namespace mimesis::tool
