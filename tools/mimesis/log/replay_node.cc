// One life of a node, run again step by step.
#include <fmt/format.h>
#include <stdlib.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <stdexcept>

#include "common/runtime/own_topics.h"
#include "tools/mimesis/log/packet_process.h"
#include "tools/mimesis/log/replay.h"

namespace mimesis::tool {
namespace {

std::vector<std::string> node_arguments(const std::string& program, const Life& life,
                                        const std::string& parameters,
                                        const std::vector<std::string>& sets, int socket) {
  std::vector<std::string> argv{program,     "--replay", std::to_string(socket), "--name",
                                life.node(), "--clock",  life.start.clock(),     "--params",
                                parameters};
  for (const std::string& set : sets) argv.insert(argv.end(), {"--set", set});
  const auto wire = [&argv](const char* option, const auto& topics) {
    for (const v1::TopicInfo& t : topics) {
      if (t.port().starts_with('.') || runtime::is_own_topic(t.topic())) continue;  // the runtime's
      argv.insert(argv.end(), {option, t.port() + "=" + t.topic()});
    }
  };
  wire("--in", life.start.inputs());
  wire("--out", life.start.outputs());
  return argv;
}

std::string missing_input(const LifeReader& reader, const RecordedStep& step,
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

class LifeReplay {
 public:
  LifeReplay(const std::vector<OpenLog>& logs, const Life& life, const ReplayOptions& options,
             const StopSignals& stop)
      : life_(life),
        options_(options),
        stop_(stop),
        reader_(logs, life),
        messages_(options.tolerance),
        comparison_(life, reader_, messages_) {}

  ReplayReport run(const std::string& program, const ReplayProgress& progress) {
    const auto started = std::chrono::steady_clock::now();
    const std::string parameters =
        folder_.path() + "/" + std::filesystem::path(life_.node()).filename().string() + ".yaml";
    std::ofstream(parameters) << life_.start.parameters();
    PacketProcess node(
        "the node",
        [&](int socket) -> launch::Command {
          return {node_arguments(program, life_, parameters, options_.sets, socket), {}};
        },
        options_.timeout_s);
    while (advance(node)) progress(reader_.log_time_ns());
    finish(node);
    report_.wall_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    return std::move(report_);
  }

 private:
  /// One step; false if it was the last one.
  bool advance(PacketProcess& node) {
    if (stop_.requested()) return interrupted();
    auto step = reader_.next();
    if (!step) return false;
    v1::ReplayStep message;
    *message.mutable_step() = step->record;
    if (!add_inputs(*step, message)) return false;
    if (failed_) return throws_no_more(*step);
    v1::ReplayOutcome outcome;
    if (const auto answered = node.ask(message, outcome, &stop_); !answered) {
      if (answered.error().reason.empty()) return interrupted();
      report_.problem = fmt::format("step {}: {}", step->number, answered.error().reason);
      return false;
    }
    follow_time(*step);
    last_ = step->record.kind();
    auto found = comparison_.compare(*step, outcome);
    if (outcome.failed()) {
      failed_ = outcome.problem();
      if (!found.empty()) found.insert(found.begin(), only_replay_failed());
    }
    return keep(found);
  }

  bool interrupted() {
    report_.result = ReplayResult::kInterrupted;
    return false;
  }
  /// The node threw in the step before this one. So did the recorded one if it was stopped then.
  bool throws_no_more(const RecordedStep& step) {
    if (step.record.kind() != v1::STEP_KIND_STOP) keep({only_replay_failed()});
    return false;
  }

  ReplayDifference only_replay_failed() {
    ReplayDifference d;
    d.step = comparison_.counts().steps - 1;
    d.time_s = end_s_;
    d.what = "the replayed step failed, the recorded one did not: " + *failed_;
    return d;
  }

  bool add_inputs(const RecordedStep& step, v1::ReplayStep& message) {
    for (const v1::TakenMessage& taken : step.record.taken()) {
      if (taken.source() >= step.sources.size()) {
        report_.problem = fmt::format("step {} names an input that is not described", step.number);
        return false;
      }
      const v1::InputSource& source = step.sources[taken.source()];
      const KeptMessage* input = reader_.input(source, taken.seq());
      if (input == nullptr) {
        report_.problem = missing_input(reader_, step, source, taken.seq());
        return false;
      }
      v1::ReplayMessage& in = *message.add_inputs();
      in.set_port(source.port());
      in.set_payload(input->payload);
      in.set_stamp_ns(input->publish_time_ns);
      in.set_seq(taken.seq());
      in.set_node(source.node());
      ++comparison_.counts().inputs;
      comparison_.counts().bytes += input->payload.size();
    }
    return true;
  }

  void follow_time(const RecordedStep& step) {
    if (step.record.kind() == v1::STEP_KIND_CREATE) return;  // before the clock is known
    end_s_ = life_.seconds(step.record.time_ns());
    if (comparison_.counts().steps == 1) begin_s_ = end_s_;
  }

  /// False if these were enough.
  bool keep(const std::vector<ReplayDifference>& found) {
    for (const ReplayDifference& d : found) {
      ++report_.difference_count;
      if (report_.differences.size() < options_.differences) report_.differences.push_back(d);
      if (report_.difference_count >= options_.differences) return false;
    }
    return true;
  }

  void finish(PacketProcess& node) {
    report_.counts = comparison_.counts();
    report_.graph_s = end_s_ - begin_s_;
    report_.tolerated = messages_.tolerated();
    if (report_.result == ReplayResult::kInterrupted) return;
    const bool stopped_early = report_.difference_count > 0 || !report_.problem.empty();
    if (!stopped_early && !failed_) report_.problem = node.finish();
    if (node.timed_out()) report_.result = ReplayResult::kTimedOut;
    if (report_.problem.empty() && !stopped_early) report_.problem = reader_.problem();
    note_missing();
    if (!stopped_early && reader_.problem().empty()) note_end();
    if (report_.result == ReplayResult::kEqual && !report_.problem.empty()) {
      report_.result = ReplayResult::kIncomplete;
    }
    if (report_.difference_count > 0) report_.result = ReplayResult::kDifferent;
  }

  void note_missing() {
    for (const auto& [topic, count] : comparison_.missing()) {
      if (!reader_.has_output(topic)) {
        report_.notes.push_back(
            fmt::format("{} is not in the log: {} messages were not compared", topic, count));
      } else if (report_.problem.empty()) {
        report_.problem = fmt::format("{} message{} on {} {} not in the log: lost", count,
                                      count == 1 ? "" : "s", topic, count == 1 ? "is" : "are");
      }
    }
  }

  void note_end() {
    if (failed_) {
      report_.notes.push_back("the last step failed, as recorded: " + *failed_);
    } else if (last_ != v1::STEP_KIND_STOP) {
      report_.notes.push_back(
          "the log ends before the node's end: it was killed, or the recording ended first");
    }
  }

  const Life& life_;
  const ReplayOptions& options_;
  const StopSignals& stop_;
  LifeReader reader_;
  ReplayCompare messages_;
  StepComparison comparison_;
  TemporaryFolder folder_;  ///< holds the parameters
  ReplayReport report_;
  std::optional<std::string> failed_;  ///< the node threw: what
  v1::StepKind last_ = v1::STEP_KIND_UNSPECIFIED;
  double begin_s_ = 0.0, end_s_ = 0.0;
};

}  // namespace

TemporaryFolder::TemporaryFolder()
    : path_((std::filesystem::temp_directory_path() / "mimesis-replay-XXXXXX").string()) {
  if (mkdtemp(path_.data()) == nullptr) {
    throw std::runtime_error(path_ + ": " + std::strerror(errno));
  }
}

ReplayReport replay_life(const std::vector<OpenLog>& logs, const Life& life,
                         const std::string& program, const ReplayOptions& options,
                         const StopSignals& stop, const ReplayProgress& progress) {
  return LifeReplay(logs, life, options, stop).run(program, progress);
}

}  // namespace mimesis::tool
