#include "tools/mimesis/log/replay_compare.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/mimesis/field_text.h"

namespace mimesis::tool {
namespace {

constexpr std::size_t kFieldsKept = 100;  // of an array, the first hundred say enough

constexpr std::size_t kDifferingBytes = 16;  // a CAN frame

/// Both from the first byte that differs.
FieldDifference bytes_differ(const std::string& name, const std::string& recorded,
                             const std::string& replayed) {
  const auto at = static_cast<std::size_t>(
      std::mismatch(recorded.begin(), recorded.end(), replayed.begin(), replayed.end()).first -
      recorded.begin());
  const auto shown = [at](const std::string& bytes) {
    const std::string text = hex(bytes, at, kDifferingBytes);
    return fmt::format("{} bytes, at {}: {}", bytes.size(), at, text.empty() ? "end" : text);
  };
  return {name, shown(recorded), shown(replayed)};
}

std::string plural(std::size_t count, std::string_view word) {
  return fmt::format("{} {}{}", count, word, count == 1 ? "" : "s");
}

MessageDifference counts_differ(const std::string& what, std::size_t recorded,
                                std::size_t replayed) {
  return {{{what, std::to_string(recorded), std::to_string(replayed)}}, 1};
}

}  // namespace

MessageDifference ReplayCompare::compare(const std::string& topic, const log::Schema* schema,
                                         std::string_view recorded, std::string_view replayed) {
  if (recorded == replayed) return {};
  DiffRules rules{.tolerance = tolerance_, .exact = tolerance_ == 0.0, .limit = kFieldsKept};
  if (schema != nullptr) {
    if (const auto it = ignored_.find(schema->name); it != ignored_.end())
      rules.ignore = it->second;
  }
  WorstDifferences worst;
  MessageDifference found = payloads_.diff({recorded, schema}, {replayed, schema}, rules, &worst);
  if (found.equal()) {
    for (const auto& [field, difference] : worst) {
      double& most = tolerated_[{topic, field}];
      most = std::max(most, difference.difference);
    }
  }
  return found;
}

ReplayDifference StepComparison::difference(const RecordedStep& step, std::string what) const {
  ReplayDifference d;
  d.step = step.number;
  d.time_s = life_.seconds(step.record.time_ns());
  d.what = std::move(what);
  return d;
}

std::vector<ReplayDifference> StepComparison::compare(const RecordedStep& step,
                                                      const v1::ReplayOutcome& outcome) {
  std::vector<ReplayDifference> found;
  if (!outcome.problem().empty() && !outcome.failed()) {
    found.push_back(difference(step, outcome.problem()));
  }
  compare_responses(step, outcome, found);
  for (const v1::ReplayMessage& output : outcome.outputs()) compare_output(step, output, found);
  compare_count(step, outcome, found);
  compare_writes(step, outcome, found);
  ++counts_.steps;
  return found;
}

void StepComparison::compare_output(const RecordedStep& step, const v1::ReplayMessage& output,
                                    std::vector<ReplayDifference>& found) {
  const KeptMessage* recorded = reader_.output(output.topic(), output.seq());
  if (recorded == nullptr) {
    ++missing_[output.topic()];
    return;
  }
  ++counts_.outputs;
  counts_.bytes += output.payload().size();
  MessageDifference fields =
      messages_.compare(output.topic(), recorded->schema, recorded->payload, output.payload());
  if (recorded->publish_time_ns != output.stamp_ns()) {
    fields.fields.insert(fields.fields.begin(),
                         {"(publish time) ns", std::to_string(recorded->publish_time_ns),
                          std::to_string(output.stamp_ns())});
    ++fields.count;
  }
  if (fields.equal()) return;
  ReplayDifference d = difference(step, fmt::format("{} #{} differs in {}", output.topic(),
                                                    output.seq(), plural(fields.count, "field")));
  d.topic = output.topic();
  d.seq = output.seq();
  d.fields = std::move(fields);
  found.push_back(std::move(d));
}

void StepComparison::compare_count(const RecordedStep& step, const v1::ReplayOutcome& outcome,
                                   std::vector<ReplayDifference>& found) {
  const std::size_t recorded = step.record.published();
  const auto replayed = static_cast<std::size_t>(outcome.outputs_size());
  if (recorded == replayed) return;
  std::map<std::string, std::uint64_t> by_topic;
  for (const v1::ReplayMessage& output : outcome.outputs()) ++by_topic[output.topic()];
  std::string topics;
  for (const auto& [topic, count] : by_topic) {
    topics += fmt::format("{}{} on {}", topics.empty() ? "" : ", ", count, topic);
  }
  ReplayDifference d =
      difference(step, fmt::format("the recorded step published {}, the replayed one {}{}",
                                   plural(recorded, "message"), replayed,
                                   topics.empty() ? "" : " (" + topics + ")"));
  std::string topic;
  if (const KeptMessage* next = replayed < recorded ? reader_.unclaimed(topic) : nullptr) {
    d.what += fmt::format("; {} #{} is the first that was not published again", topic, next->seq);
    d.topic = topic;
    d.seq = next->seq;
  }
  d.fields = counts_differ("(messages)", recorded, replayed);
  found.push_back(std::move(d));
}

void StepComparison::compare_writes(const RecordedStep& step, const v1::ReplayOutcome& outcome,
                                    std::vector<ReplayDifference>& found) {
  std::vector<const v1::OutsideBytes*> recorded;
  for (const v1::OutsideBytes& bytes : step.record.outside()) {
    if (bytes.written()) recorded.push_back(&bytes);
  }
  const auto replayed = static_cast<std::size_t>(outcome.written_size());
  for (std::size_t i = 0; i < std::min(recorded.size(), replayed); ++i) {
    const v1::OutsideBytes &a = *recorded[i], &b = outcome.written(static_cast<int>(i));
    if (a.name() == b.name() && a.data() == b.data()) continue;
    ReplayDifference d = difference(
        step, a.name() == b.name()
                  ? fmt::format("write {} of the step, to '{}', differs", i + 1, a.name())
                  : fmt::format("write {} of the step goes to '{}', the recorded one went to '{}'",
                                i + 1, b.name(), a.name()));
    d.fields = {{bytes_differ("(written) " + a.name(), a.data(), b.data())}, 1};
    found.push_back(std::move(d));
    break;  // all later ones may be shifted
  }
  counts_.writes += std::min(recorded.size(), replayed);
  if (recorded.size() == replayed) return;
  ReplayDifference d =
      difference(step, fmt::format("the recorded step wrote {} to the outside, the replayed one {}",
                                   plural(recorded.size(), "packet"), replayed));
  d.fields = counts_differ("(packets written)", recorded.size(), replayed);
  found.push_back(std::move(d));
}

void StepComparison::compare_responses(const RecordedStep& step, const v1::ReplayOutcome& outcome,
                                       std::vector<ReplayDifference>& found) {
  const int both = std::min(step.record.requests_size(), outcome.served_size());
  for (int i = 0; i < both; ++i) {
    const v1::ServedRequest &a = step.record.requests(i), &b = outcome.served(i);
    ++counts_.responses;
    if (a.response() == b.response() && a.failure() == b.failure()) continue;
    ReplayDifference d = difference(
        step, fmt::format("the response of service '{}' before the step differs", a.service()));
    if (a.failure() != b.failure()) {
      d.fields.fields.push_back({"(failure)", a.failure(), b.failure()});
    }
    if (a.response() != b.response()) {
      d.fields.fields.push_back(bytes_differ("(response)", a.response(), b.response()));
    }
    d.fields.count = d.fields.fields.size();
    found.push_back(std::move(d));
  }
  // Too few: the node has no such service, which is its problem already.
}

}  // namespace mimesis::tool
