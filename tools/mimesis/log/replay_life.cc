#include "tools/mimesis/log/replay_life.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "common/runtime/own_topics.h"

namespace mimesis::tool {
namespace {

/// How much later than the step that took it a message may have reached the recorder [ns of log
/// time]. In lock-step there is no such delay; between hosts a second was never seen.
constexpr std::uint64_t kLate = 5'000'000'000;

/// Logs keep the lower half of the sequence number.
std::uint64_t logged_seq(std::uint64_t seq) { return seq & 0xFFFF'FFFFu; }

std::uint64_t count_step_logs(const std::vector<OpenLog>& logs, const v1::NodeStart& start) {
  std::uint64_t count = 0;
  for (const OpenLog& log : logs) {
    for (const auto& [id, channel] : log.summary.channels) {
      if (channel.topic != start.node() + "/steps" || start_id_of(channel) != start.start_id())
        continue;
      const auto& counts = log.summary.statistics.channel_message_counts;
      if (const auto it = counts.find(id); it != counts.end()) count += it->second;
    }
  }
  return count;
}

}  // namespace

double Life::seconds(std::uint64_t time_ns) const {
  const std::uint64_t epoch = start.clock() == "wall" ? start.header().stamp_ns() : 0;
  return static_cast<double>(static_cast<std::int64_t>(time_ns - epoch)) * 1e-9;
}

std::uint64_t start_id_of(const log::Channel& channel) {
  const std::string text = start_of(channel);
  std::uint64_t id = 0;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), id);
  return parsed.ec == std::errc() && parsed.ptr == text.data() + text.size() ? id : 0;
}

std::vector<Life> find_lives(const std::vector<OpenLog>& logs) {
  std::vector<Life> lives;
  auto reader = merged(logs, {.channel = [](const log::Channel& channel) {
                         return runtime::is_own_topic(channel.topic, runtime::kStartPort);
                       }});
  const std::string type = v1::NodeStart::descriptor()->full_name();
  while (const auto* item = reader.next()) {
    Life life;
    if (item->schema == nullptr || item->schema->name != type) continue;
    const std::string_view data = item->message->data;
    if (!life.start.ParseFromArray(data.data(), static_cast<int>(data.size()))) continue;
    const bool known = std::ranges::any_of(
        lives, [&](const Life& other) { return other.start.start_id() == life.start.start_id(); });
    if (known) continue;  // repeated at the head of a split
    life.log_time_ns = item->message->log_time;
    life.step_logs = count_step_logs(logs, life.start);
    lives.push_back(std::move(life));
  }
  return lives;
}

LifeReader::LifeReader(const std::vector<OpenLog>& logs, const Life& life)
    : logs_(logs), life_(life), reader_(merged(logs, selection())) {}

/// Also makes the tracks, so that what is in the log at all can be told from what is missing.
log::Selection LifeReader::selection() {
  for (const v1::TopicInfo& input : life_.start.inputs()) {
    if (input.port().starts_with('.')) continue;  // the runtime's own
    const auto [track, fresh] = fresh_inputs_.try_emplace(input.topic());
    track->second.taken[input.port()] = 0;
    track->second.only_latest = (fresh || track->second.only_latest) && input.policy() == "latest";
  }
  const auto role = [this](const log::Channel& channel) {
    const bool own =
        sender_of(channel) == life_.node() && start_id_of(channel) == life_.start.start_id();
    return std::pair(own && !runtime::is_own_topic(channel.topic),
                     own && channel.topic == life_.node() + "/steps");
  };
  for (const OpenLog& log : logs_) {
    for (const auto& [id, channel] : log.summary.channels) {
      if (const auto input = fresh_inputs_.find(channel.topic); input != fresh_inputs_.end()) {
        inputs_.try_emplace({channel.topic, start_id_of(channel)}, input->second);
      }
      if (role(channel).first) outputs_[channel.topic];
    }
  }
  return {.channel = [this, role](const log::Channel& channel) {
    const auto [is_output, is_steps] = role(channel);
    return is_output || is_steps || fresh_inputs_.contains(channel.topic);
  }};
}

bool LifeReader::has_input(const v1::InputSource& source) const {
  return inputs_.contains({source.topic(), source.start_id()});
}

bool LifeReader::read() {
  const auto* item = reader_.next();
  if (item == nullptr) return false;
  const log::Message& message = *item->message;
  const log::Channel& channel = *item->channel;
  log_time_ns_ = message.log_time;
  const bool own =
      sender_of(channel) == life_.node() && start_id_of(channel) == life_.start.start_id();
  if (own && channel.topic == life_.node() + "/steps") {
    ++step_logs_read_;
    v1::StepLog log;
    if (log.ParseFromArray(message.data.data(), static_cast<int>(message.data.size()))) {
      waiting_.emplace_back(message.log_time, std::move(log));
    }
    return true;
  }
  const auto keep = [&](Track& track) {
    if (message.sequence <= track.done) return;  // repeated at the head of a split
    track.messages.try_emplace(message.sequence,
                               KeptMessage{std::string(message.data), message.sequence,
                                           message.publish_time, message.log_time, item->schema});
  };
  if (own) {
    if (const auto it = outputs_.find(channel.topic); it != outputs_.end()) keep(it->second);
  }
  const bool before_life = message.log_time + kLate < life_.log_time_ns && !is_latched(channel);
  if (const auto it = inputs_.find({channel.topic, start_id_of(channel)});
      it != inputs_.end() && !before_life) {
    keep(it->second);
  }
  return true;
}

bool LifeReader::next_step_log() {
  while (waiting_.empty() && step_logs_read_ < life_.step_logs && read()) {
  }
  if (waiting_.empty()) {
    if (life_.step_logs == 0) {
      problem_ = fmt::format("there is no message on {}/steps in the log", life_.node());
    } else if (step_logs_read_ < life_.step_logs) {
      problem_ = fmt::format("{} of the {} messages on {}/steps cannot be read",
                             life_.step_logs - step_logs_read_, life_.step_logs, life_.node());
    }
    return false;
  }
  step_log_time_ns_ = waiting_.front().first;
  step_log_ = std::move(waiting_.front().second);
  waiting_.erase(waiting_.begin());
  next_step_ = 0;
  if (step_log_.first() == next_number_) return true;
  if (next_number_ == 0) {
    problem_ = fmt::format(
        "steps 0 to {} are not in the log: the log was begun after the node, and a replay needs "
        "the "
        "node from its constructor on",
        step_log_.first() - 1);
  } else if (step_log_.first() > next_number_) {
    problem_ =
        fmt::format("steps {} to {} are not in the log: lost", next_number_, step_log_.first() - 1);
  } else {
    problem_ = fmt::format("step {} is in the log twice", step_log_.first());
  }
  return false;
}

std::optional<RecordedStep> LifeReader::next() {
  while (next_step_ >= step_log_.steps_size()) {
    forget();
    if (!next_step_log()) return std::nullopt;
  }
  RecordedStep step;
  step.number = next_number_++;
  step.record = step_log_.steps(next_step_++);
  step.sources = {step_log_.sources().begin(), step_log_.sources().end()};
  return step;
}

const KeptMessage* LifeReader::find(const Track& track, std::uint64_t seq) {
  for (;;) {
    const auto it = track.messages.find(logged_seq(seq));
    if (it != track.messages.end()) return &it->second;
    if (log_time_ns_ > step_log_time_ns_ + kLate || !read()) return nullptr;
  }
}

const KeptMessage* LifeReader::input(const v1::InputSource& source, std::uint64_t seq) {
  const auto track = inputs_.find({source.topic(), source.start_id()});
  if (track == inputs_.end()) return nullptr;
  const KeptMessage* message = find(track->second, seq);
  std::uint64_t& taken = track->second.taken[source.port()];
  taken = std::max(taken, logged_seq(seq));
  return message;
}

const KeptMessage* LifeReader::output(const std::string& topic, std::uint64_t seq) {
  const auto track = outputs_.find(topic);
  if (track == outputs_.end()) return nullptr;
  auto& messages = track->second.messages;
  messages.erase(messages.begin(), messages.lower_bound(logged_seq(seq)));
  track->second.done = logged_seq(seq);
  return find(track->second, seq);
}

const KeptMessage* LifeReader::unclaimed(std::string& topic) const {
  const KeptMessage* first = nullptr;
  for (const auto& [name, track] : outputs_) {
    const auto it = track.messages.upper_bound(track.done);
    if (it == track.messages.end() || it->second.log_time_ns > step_log_time_ns_) continue;
    if (first != nullptr && first->log_time_ns <= it->second.log_time_ns) continue;
    first = &it->second;
    topic = name;
  }
  return first;
}

void LifeReader::forget() {
  for (auto& [key, track] : inputs_) {
    std::uint64_t everywhere = ~0ull;
    for (const auto& [port, seq] : track.taken) everywhere = std::min(everywhere, seq);
    track.done = std::max(track.done, everywhere);
    auto& messages = track.messages;
    messages.erase(messages.begin(), messages.upper_bound(track.done));
    // What a newer message has replaced before the step was never seen.
    while (track.only_latest && messages.size() > 1 &&
           std::next(messages.begin())->second.log_time_ns + kLate < step_log_time_ns_) {
      messages.erase(messages.begin());
    }
  }
  for (auto& [topic, track] : outputs_) {
    std::erase_if(track.messages, [this](const auto& entry) {
      return entry.second.log_time_ns + kLate < step_log_time_ns_;
    });
  }
}

std::vector<log::Damage> LifeReader::damages() const {
  std::vector<log::Damage> all;
  for (std::size_t i = 0; i < logs_.size(); ++i) {
    const auto& more = reader_.damages(i);
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

}  // namespace mimesis::tool
