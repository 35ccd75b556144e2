#pragma once
#include <fmt/format.h>

#include <fstream>
#include <string>
#include <vector>

#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/log/packet_process.h"
#include "tools/mimesis/log/program_name.h"
#include "tools/mimesis/log/replay.h"
#include "tools/mimesis/log/replay_log.h"

// A recorded run of a node, stepped again: shared by the verbs that compare and that restore.
namespace mimesis::tool {

/// Path of the program to run a node again: the `wanted` one (a folder: of the recorded name in
/// it), else that of the recorded name beside this program. A log is data: it chooses no other.
/// @throws ConfigError if there is none, or if the log names what is no node's program
inline std::string program_of(const NodeRun& node_run, const std::string& wanted) {
  namespace fs = std::filesystem;
  const std::string& recorded = node_run.start.executable();
  std::error_code ignored;
  std::string path = wanted;
  if (wanted.empty() || fs::is_directory(wanted, ignored)) {
    if (wanted.empty() ? !is_program_name(recorded) : !is_file_name(recorded)) {
      throw ConfigError(fmt::format(
          "node '{}': the log names the program '{}', expected {}; --exec PATH says which one to "
          "run",
          node_run.node(), printable(recorded),
          wanted.empty() ? "mimesis_NAME, without a folder" : "a name without a folder"));
    }
    const fs::path folder = wanted.empty()
                                ? fs::read_symlink("/proc/self/exe", ignored).parent_path()
                                : fs::path(wanted);
    path = folder / recorded;
  }
  const std::string found = launch::find_executable(path);
  if (found.empty()) {
    throw ConfigError(fmt::format("node '{}': there is no program {}; --exec PATH names another",
                                  node_run.node(), path));
  }
  return found;
}

/// The program as a replay starts it; `socket`: its steps come there. `folder` is for its
/// parameters, and all that it may write to.
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
