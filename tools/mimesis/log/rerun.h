#pragma once
#include <optional>
#include <string>

#include "tools/mimesis/log/replay_step.h"

namespace mimesis::tool {

/// A recorded run of a node whose steps run again, in a process of its own.
class NodeRerun {
 public:
  /// The logs and the run outlive it. `unconfined`: see log replay.
  /// @throws ConfigError if the log names a program that it may not
  NodeRerun(const std::vector<OpenLog>& logs, const NodeRun& node_run, bool unconfined)
      : logs_(logs),
        run_(node_run),
        node_(
            "node '" + node_run.node() + "'",
            [&](int socket) {
              return replay_command(program_of(node_run, ""), node_run, folder_.path(), {}, socket);
            },
            kStepTimeout_s, unconfined ? "" : folder_.path()) {
    rewind();
  }

  /// The next step with its inputs, in the order of the log.
  tl::expected<v1::ReplayStep, Status> next() {
    v1::ReplayStep message;
    const auto step = reader_->next();
    if (!step) {
      const std::string& why = reader_->problem();
      return tl::unexpected(Status{why.empty() ? "the node's steps end before" : why});
    }
    if (std::string why = fill_step(*reader_, *step, message); !why.empty())
      return tl::unexpected(Status{std::move(why)});
    return message;
  }
  /// From the first step on, with the same process: of a node whose steps need none of those
  /// before.
  void rewind() { reader_.emplace(logs_, run_); }

  tl::expected<v1::ReplayOutcome, Status> run(const v1::ReplayStep& step) {
    v1::ReplayOutcome outcome;
    try {
      node_.ask(step, outcome);
    } catch (const PacketProcess::Gone& gone) {
      return tl::unexpected(Status{gone.what()});
    }
    if (outcome.failed()) return tl::unexpected(Status{outcome.problem()});
    return outcome;
  }

 private:
  static constexpr double kStepTimeout_s = 60.0;

  const std::vector<OpenLog>& logs_;
  const NodeRun& run_;
  std::optional<NodeRunReader> reader_;
  TemporaryFolder folder_;
  PacketProcess node_;
};

}  // namespace mimesis::tool
