#pragma once
#include <fmt/format.h>

#include <fstream>
#include <string>
#include <vector>

#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/log/packet_process.h"
#include "tools/mimesis/log/replay.h"
#include "tools/mimesis/log/replay_log.h"

// A recorded run of a node, stepped again: shared by the verbs that compare and that restore.
namespace mimesis::tool {

/// Path of the program that ran a run, or of the `wanted` one (a folder: of the same name in it).
/// @throws ConfigError if there is none
inline std::string program_of(const NodeRun& node_run, std::string wanted) {
  if (wanted.empty()) wanted = node_run.start.executable();
  if (std::error_code ignored; std::filesystem::is_directory(wanted, ignored)) {
    wanted += "/" + node_run.start.executable();
  }
  const std::string path = launch::find_executable(wanted);
  if (path.empty()) {
    throw ConfigError(fmt::format(
        "node '{}': there is no program '{}' beside this one or on PATH; --exec PATH names another",
        node_run.node(), wanted));
  }
  return path;
}

/// The program as a replay starts it; `socket`: its steps come there. `folder` is for its
/// parameters.
inline launch::Command replay_command(const std::string& program, const NodeRun& node_run,
                                      const std::string& folder,
                                      const std::vector<std::string>& sets, int socket) {
  const std::string parameters =
      folder + "/" + std::filesystem::path(node_run.node()).filename().string() + ".yaml";
  std::ofstream(parameters) << node_run.start.parameters();
  std::vector<std::string> argv{program,         "--replay", std::to_string(socket), "--name",
                                node_run.node(), "--clock",  node_run.start.clock(), "--params",
                                parameters};
  for (const std::string& set : sets) argv.insert(argv.end(), {"--set", set});
  const auto wire = [&argv](const char* option, const auto& topics) {
    for (const v1::TopicInfo& t : topics) {
      if (t.port().starts_with('.') || runtime::is_own_topic(t.topic())) continue;  // the runtime's
      argv.insert(argv.end(), {option, t.port() + "=" + t.topic()});
    }
  };
  wire("--in", node_run.start.inputs());
  wire("--out", node_run.start.outputs());
  return {argv, {}};
}

inline std::string missing_input(const NodeRunReader& reader, const RecordedStep& step,
                                 const v1::InputSource& source, std::uint64_t seq) {
  std::string why = "the message is not in the log: lost";
  if (!reader.has_input(source)) why = "the log does not hold this topic of that node";
  if (reader.was_let_go(source, seq)) {
    why = fmt::format("it was let go: more than {} MB of inputs waited to be taken",
                      kMostInputBytes / 1'000'000);
  }
  return fmt::format("step {} took {} #{} of node '{}' on input '{}': {}", step.number,
                     source.topic(), seq, source.node(), source.port(), why);
}

/// Gives the node a step with all its inputs. Returns why it cannot take them, or nothing.
inline std::string fill_step(NodeRunReader& reader, const RecordedStep& step,
                             v1::ReplayStep& message) {
  *message.mutable_step() = step.record;
  for (const v1::TakenMessage& taken : step.record.taken()) {
    if (taken.source() >= step.sources.size())
      return fmt::format("step {} names an input that is not described", step.number);
    const v1::InputSource& source = step.sources[taken.source()];
    const KeptMessage* input = reader.input(source, taken.seq());
    if (input == nullptr) return missing_input(reader, step, source, taken.seq());
    v1::ReplayMessage& in = *message.add_inputs();
    in.set_port(source.port());
    in.set_payload(input->payload);
    in.set_stamp_ns(input->publish_time_ns);
    in.set_seq(taken.seq());
    in.set_node(source.node());
  }
  return {};
}

}  // namespace mimesis::tool
