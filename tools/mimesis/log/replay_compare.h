#pragma once
#include <fmt/format.h>

#include "tools/mimesis/log/message_diff.h"
#include "tools/mimesis/log/replay_log.h"

namespace mimesis::tool {

/// Largest |recorded - replayed| that was tolerated, by topic and field ("q_rad" for all elements).
using Tolerated = std::map<std::pair<std::string, std::string>, double>;

/// Adds the difference of two numbers that belong to messages, if there is one; before the others.
inline void compare_numbers(MessageDifference& d, const char* what, std::uint64_t recorded,
                            std::uint64_t replayed) {
  if (recorded == replayed) return;
  d.fields.insert(d.fields.begin(), {what, std::to_string(recorded), std::to_string(replayed)});
  ++d.count;
}

/// Compares messages of a replay with recorded ones.
class ReplayCompare {
 public:
  /// @param tolerance  floating-point fields may differ by this; 0: all bytes must be equal
  explicit ReplayCompare(double tolerance) : tolerance_(tolerance) {}

  /// `schema`: of the recorded one, may be null. If it is that of an older version, fields that
  /// only one version has do not count.
  MessageDifference compare(const std::string& topic, const log::Schema* schema,
                            std::string_view recorded, std::string_view replayed) {
    if (recorded == replayed) return {};
    constexpr std::size_t kFieldsKept = 100;  // the first hundred elements of an array are enough
    DiffRules rules{.tolerance = tolerance_, .exact = tolerance_ == 0.0, .limit = kFieldsKept};
    const log::Schema* present = schema == nullptr ? nullptr : &present_schema(*schema);
    rules.across_versions = present != schema;
    if (rules.across_versions) older_.insert(schema->name);
    WorstDifferences worst;
    MessageDifference found =
        payloads_.diff({recorded, schema}, {replayed, present}, rules, &worst);
    if (!found.equal()) return found;
    for (const auto& [field, difference] : worst) {
      double& most = tolerated_[{topic, field}];
      most = std::max(most, difference.difference);
    }
    return found;
  }
  const Tolerated& tolerated() const { return tolerated_; }
  /// Types of compared messages of which the log has another version than this one.
  const std::set<std::string>& older() const { return older_; }

 private:
  /// What this version has for the type: `recorded` itself if they are equal or it has none.
  const log::Schema& present_schema(const log::Schema& recorded) {
    const auto [it, first] = present_.try_emplace(recorded.name, recorded);
    const google::protobuf::Descriptor* type =
        google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(recorded.name);
    if (first && type != nullptr) it->second.data = runtime::descriptor_set(*type);
    return it->second.data == recorded.data ? recorded : it->second;
  }

  double tolerance_;
  std::map<std::string, log::Schema> present_;  ///< by type
  std::set<std::string> older_;
  PayloadDiff payloads_;
  Tolerated tolerated_;
};

/// A difference between a replay and the log.
struct ReplayDifference {
  std::uint64_t step = 0;
  double time_s = 0.0;  ///< graph time
  std::string what;     ///< one line: "planner/command #83: 2 fields differ"
  std::string topic;    ///< topic of a message, else empty
  std::uint64_t seq = 0;
  MessageDifference fields;  ///< recorded and replayed values
};

/// Counts of all that was compared.
struct ReplayCounts {
  std::uint64_t steps = 0, inputs = 0, outputs = 0, writes = 0, responses = 0;
  std::uint64_t bytes = 0;  ///< bytes of these messages
};

/// Compares what replayed steps of one run did with the record.
class StepComparison {
 public:
  /// All outlive it.
  StepComparison(const NodeRun& node_run, NodeRunReader& reader, ReplayCompare& messages)
      : run_(node_run), reader_(reader), messages_(messages) {}

  /// All differences of a step, the likely cause first.
  std::vector<ReplayDifference> compare(const RecordedStep& step,
                                        const v1::ReplayOutcome& outcome) {
    step_ = &step;
    found_.clear();
    if (!outcome.problem().empty() && !outcome.failed()) differs(outcome.problem());
    compare_responses(outcome);
    for (const v1::ReplayMessage& output : outcome.outputs()) compare_output(output);
    compare_count(outcome);
    compare_writes(outcome);
    ++counts_.steps;
    return std::move(found_);
  }

  ReplayCounts& counts() { return counts_; }
  /// Outputs that the log does not hold, by topic: lost, or (all of a topic) left out.
  const std::map<std::string, std::uint64_t>& missing() const { return missing_; }

 private:
  static std::string plural(std::size_t count, std::string_view word) {
    return fmt::format("{} {}{}", count, word, count == 1 ? "" : "s");
  }
  ReplayDifference& differs(std::string what) {
    ReplayDifference& d = found_.emplace_back();
    d.step = step_->number;
    d.time_s = run_.seconds(step_->record.time_ns());
    d.what = std::move(what);
    return d;
  }
  static void compare_bytes(MessageDifference& d, const std::string& name, const std::string& a,
                            const std::string& b) {
    if (a == b) return;
    d.fields.push_back(byte_difference(name, a, b, ""));
    ++d.count;
  }

  void compare_output(const v1::ReplayMessage& output) {
    const KeptMessage* recorded = reader_.output(output.topic(), output.seq());
    if (recorded == nullptr) {
      ++missing_[output.topic()];
      return;
    }
    ++counts_.outputs;
    counts_.bytes += output.payload().size();
    MessageDifference fields =
        messages_.compare(output.topic(), recorded->schema, recorded->payload, output.payload());
    compare_numbers(fields, "(publish time) ns", recorded->publish_time_ns, output.stamp_ns());
    if (fields.equal()) return;
    ReplayDifference& d = differs(fmt::format("{} #{} differs in {}", output.topic(), output.seq(),
                                              plural(fields.count, "field")));
    d.topic = output.topic();
    d.seq = output.seq();
    d.fields = std::move(fields);
  }

  void compare_count(const v1::ReplayOutcome& outcome) {
    const std::size_t recorded = step_->record.published();
    const auto replayed = static_cast<std::size_t>(outcome.outputs_size());
    if (recorded == replayed) return;
    std::map<std::string, std::uint64_t> by_topic;
    for (const v1::ReplayMessage& output : outcome.outputs()) ++by_topic[output.topic()];
    std::string topics;
    for (const auto& [topic, count] : by_topic) {
      topics += fmt::format("{}{} on {}", topics.empty() ? "" : ", ", count, topic);
    }
    ReplayDifference& d = differs(fmt::format(
        "the recorded step published {}, the replayed one {}{}", plural(recorded, "message"),
        replayed, topics.empty() ? "" : " (" + topics + ")"));
    compare_numbers(d.fields, "(messages)", recorded, replayed);
    std::string topic;
    const KeptMessage* next = replayed < recorded ? reader_.unclaimed(topic) : nullptr;
    if (next == nullptr) return;
    d.what += fmt::format("; {} #{} is the first that was not published again", topic, next->seq);
    d.topic = topic;
    d.seq = next->seq;
  }

  void compare_writes(const v1::ReplayOutcome& outcome) {
    std::vector<const v1::OutsideBytes*> recorded;
    for (const v1::OutsideBytes& bytes : step_->record.outside()) {
      if (bytes.written()) recorded.push_back(&bytes);
    }
    const auto replayed = static_cast<std::size_t>(outcome.written_size());
    const std::size_t both = std::min(recorded.size(), replayed);
    counts_.writes += both;
    for (std::size_t i = 0; i < both; ++i) {
      const v1::OutsideBytes &a = *recorded[i], &b = outcome.written(static_cast<int>(i));
      if (a.name() == b.name() && a.data() == b.data()) continue;
      ReplayDifference& d = differs(
          a.name() == b.name()
              ? fmt::format("write {} of the step, to '{}', differs", i + 1, a.name())
              : fmt::format("write {} of the step goes to '{}', the recorded one went to '{}'",
                            i + 1, b.name(), a.name()));
      compare_bytes(d.fields, "(written) " + a.name(), a.data(), b.data());
      break;  // all later ones may be shifted
    }
    if (recorded.size() == replayed) return;
    ReplayDifference& d =
        differs(fmt::format("the recorded step wrote {} to the outside, the replayed one {}",
                            plural(recorded.size(), "packet"), replayed));
    compare_numbers(d.fields, "(packets written)", recorded.size(), replayed);
  }

  void compare_responses(const v1::ReplayOutcome& outcome) {
    // Too few: the node has no such service, which is its problem already.
    const int both = std::min(step_->record.requests_size(), outcome.served_size());
    for (int i = 0; i < both; ++i) {
      const v1::ServedRequest &a = step_->record.requests(i), &b = outcome.served(i);
      ++counts_.responses;
      if (a.response() == b.response() && a.failure() == b.failure()) continue;
      MessageDifference& d =
          differs(fmt::format("the response of service '{}' before the step differs", a.service()))
              .fields;
      if (a.failure() != b.failure()) {
        d.fields.push_back({"(failure)", a.failure(), b.failure()});
        ++d.count;
      }
      compare_bytes(d, "(response)", a.response(), b.response());
    }
  }

  const NodeRun& run_;
  NodeRunReader& reader_;
  ReplayCompare& messages_;
  const RecordedStep* step_ = nullptr;   ///< being compared
  std::vector<ReplayDifference> found_;  ///< in it
  ReplayCounts counts_;
  std::map<std::string, std::uint64_t> missing_;
};

}  // namespace mimesis::tool
