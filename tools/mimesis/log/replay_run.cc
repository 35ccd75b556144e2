// One life, step by step.
#include <fmt/format.h>

#include <chrono>

#include "tools/mimesis/log/replay.h"
#include "tools/mimesis/log/replay_node.h"

namespace mimesis::tool {
namespace {

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

  LifeReport run(const std::string& program, const std::function<void(std::uint64_t)>& progress) {
    const auto started = std::chrono::steady_clock::now();
    ReplayNode node(program, life_, options_.sets, options_.timeout_s);
    while (advance(node)) progress(reader_.log_time_ns());
    finish(node);
    report_.wall_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    return std::move(report_);
  }

 private:
  /// One step; false if it was the last one.
  bool advance(ReplayNode& node) {
    if (stop_.requested()) return interrupted();
    auto step = reader_.next();
    if (!step) return false;
    v1::ReplayStep message;
    *message.mutable_step() = step->record;
    if (!add_inputs(*step, message)) return false;
    if (failed_) return throws_no_more(*step);
    const auto outcome = node.run(message, stop_);
    if (!outcome) {
      if (outcome.error().reason.empty()) return interrupted();
      report_.problem = fmt::format("step {}: {}", step->number, outcome.error().reason);
      return false;
    }
    follow_time(*step);
    last_ = step->record.kind();
    auto found = comparison_.compare(*step, *outcome);
    if (outcome->failed()) {
      failed_ = outcome->problem();
      if (!found.empty()) found.insert(found.begin(), only_replay_failed());
    }
    return keep(found);
  }

  bool interrupted() {
    report_.result = ReplayResult::interrupted;
    return false;
  }

  /// The node threw in the step before this one. So did the recorded one if it was stopped then.
  bool throws_no_more(const RecordedStep& step) {
    if (step.record.kind() != v1::STEP_KIND_STOP) keep({only_replay_failed()});
    return false;
  }

  ReplayDifference only_replay_failed() const {
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

  void finish(ReplayNode& node) {
    report_.counts = comparison_.counts();
    report_.graph_s = end_s_ - begin_s_;
    report_.tolerated = messages_.tolerated();
    if (report_.result == ReplayResult::interrupted) return;
    const bool stopped_early = report_.difference_count > 0 || !report_.problem.empty();
    if (!stopped_early && !failed_) report_.problem = node.finish();
    if (node.timed_out()) report_.result = ReplayResult::timed_out;
    if (report_.problem.empty() && !stopped_early) report_.problem = reader_.problem();
    note_missing();
    if (!stopped_early && reader_.problem().empty()) note_end();
    if (report_.result == ReplayResult::equal && !report_.problem.empty()) {
      report_.result = ReplayResult::incomplete;
    }
    if (report_.difference_count > 0) report_.result = ReplayResult::different;
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
  LifeReport report_;
  std::optional<std::string> failed_;  ///< the node threw: what
  v1::StepKind last_ = v1::STEP_KIND_UNSPECIFIED;
  double begin_s_ = 0.0, end_s_ = 0.0;
};

}  // namespace

LifeReport replay_life(const std::vector<OpenLog>& logs, const Life& life,
                       const std::string& program, const ReplayOptions& options,
                       const StopSignals& stop,
                       const std::function<void(std::uint64_t log_time_ns)>& progress) {
  return LifeReplay(logs, life, options, stop).run(program, progress);
}

}  // namespace mimesis::tool
