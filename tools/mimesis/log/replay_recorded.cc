#include "tools/mimesis/log/replay_recorded.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/runtime/own_topics.h"

namespace mimesis::tool {
namespace {

std::optional<std::uint64_t> first_message(const std::vector<OpenLog>& logs,
                                           const std::string& topic) {
  auto reader = merged(
      logs, {.channel = [&](const log::Channel& channel) { return channel.topic == topic; }});
  const auto* item = reader.next();
  return item == nullptr ? std::nullopt : std::optional(item->message->log_time);
}

/// Graph time and name of the node that was the first to stop.
std::optional<std::pair<std::uint64_t, std::string>> first_stop(const std::vector<OpenLog>& logs) {
  std::optional<std::pair<std::uint64_t, std::string>> first;
  auto reader = merged(logs, {.channel = [](const log::Channel& channel) {
                         return runtime::is_own_topic(channel.topic, runtime::kStepsPort);
                       }});
  v1::StepLog log;
  while (const auto* item = reader.next()) {
    const std::string_view data = item->message->data;
    if (!log.ParseFromArray(data.data(), static_cast<int>(data.size()))) continue;
    for (const v1::StepRecord& step : log.steps()) {
      if (step.kind() != v1::STEP_KIND_STOP || (first && first->first <= step.time_ns())) continue;
      first = {step.time_ns(), sender_of(*item->channel)};
    }
  }
  return first;
}

}  // namespace

RunLimit run_limit(const std::vector<OpenLog>& logs, const std::string& until_topic) {
  if (const auto verdict = first_message(logs, until_topic)) {
    return {*verdict, fmt::format("{} ended the run", until_topic), false};
  }
  if (const auto stop = first_stop(logs)) {
    return {stop->first == 0 ? 0 : stop->first - 1, fmt::format("node '{}' stopped", stop->second),
            false};
  }
  return {span_of(logs).end_ns, "the log ends", true};
}

RecordedRun::RecordedRun(const std::vector<OpenLog>& logs, std::uint64_t until_ns)
    : reader_(merged(logs, {.channel =
                                [](const log::Channel& channel) {
                                  return !runtime::is_own_topic(channel.topic);
                                },
                            .end_time = until_ns + 1})) {
  for (const OpenLog& log : logs) {
    for (const auto& [id, channel] : log.summary.channels) {
      if (!runtime::is_own_topic(channel.topic)) waiting_[{channel.topic, sender_of(channel)}];
    }
  }
}

bool RecordedRun::read() {
  const auto* item = reader_.next();
  if (item == nullptr) return false;
  const log::Message& message = *item->message;
  log_time_ns_ = message.log_time;
  Track& track = waiting_[{item->channel->topic, sender_of(*item->channel)}];
  std::uint64_t& last = track.last_seq[start_id_of(*item->channel)];
  if (message.sequence <= last) return true;  // repeated at the head of a split
  last = message.sequence;
  track.messages.push_back({std::string(message.data), message.sequence, message.publish_time,
                            message.log_time, item->schema});
  ++waiting_count_;
  return true;
}

std::optional<KeptMessage> RecordedRun::next(const TopicOfNode& key, std::uint64_t time_ns) {
  const auto track = waiting_.find(key);
  if (track == waiting_.end()) return std::nullopt;
  auto& messages = track->second.messages;
  while (messages.empty()) {
    if (log_time_ns_ > time_ns || !read()) return std::nullopt;
  }
  if (messages.front().log_time_ns > time_ns) return std::nullopt;
  KeptMessage message = std::move(messages.front());
  messages.pop_front();
  --waiting_count_;
  return message;
}

bool RecordedRun::finished() {
  while (waiting_count_ == 0) {
    if (!read()) return true;
  }
  return false;
}

const KeptMessage* RecordedRun::earliest(TopicOfNode& key) const {
  const KeptMessage* first = nullptr;
  for (const auto& [name, track] : waiting_) {
    if (track.messages.empty()) continue;
    const KeptMessage& message = track.messages.front();
    if (first != nullptr && first->log_time_ns <= message.log_time_ns) continue;
    first = &message;
    key = name;
  }
  return first;
}

}  // namespace mimesis::tool
