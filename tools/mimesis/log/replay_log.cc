#include "tools/mimesis/log/replay_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "common/runtime/own_topics.h"

namespace mimesis::tool {
namespace {

std::size_t size_of(const KeptMessage& message) {
  return message.payload.size() + sizeof(KeptMessage);
}

/// Counts them into `life`.
void count_step_logs(const std::vector<OpenLog>& logs, Life& life) {
  for (const OpenLog& log : logs) {
    for (const auto& [id, channel] : log.summary.channels) {
      if (channel.topic != life.node() + "/steps") continue;
      const auto& counts = log.summary.statistics.channel_message_counts;
      const auto it = counts.find(id);
      if (it == counts.end()) continue;
      const std::uint64_t start = start_id_of(channel);
      if (start == life.start.start_id()) {
        life.step_logs += it->second;
      } else if (start == 0) {
        life.other_steps += it->second;
      }
    }
  }
}

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

void WaitingInputs::add_port(const std::string& topic, const std::string& port, bool latest) {
  ports_[topic][port] = {latest, 0};
}

void WaitingInputs::add_publisher(const std::string& topic, std::uint64_t start_id) {
  if (const auto it = ports_.find(topic); it != ports_.end()) {
    tracks_[{topic, start_id}].ports = it->second;
  }
}

bool WaitingInputs::has_publisher(const std::string& topic, std::uint64_t start_id) const {
  return tracks_.contains({topic, start_id});
}

void WaitingInputs::keep(const std::string& topic, std::uint64_t start_id, KeptMessage message) {
  const auto it = tracks_.find({topic, start_id});
  if (it == tracks_.end()) return;
  Track& track = it->second;
  if (message.seq <= std::max(track.done, track.let_go)) return;  // repeated at a split's head
  const std::size_t size = size_of(message);
  if (!track.messages.try_emplace(message.seq, std::move(message)).second) return;
  track.bytes += size;
  bytes_ += size;
  if (bytes_ > most_bytes_) limit_bytes();
}

const KeptMessage* WaitingInputs::find(const v1::InputSource& source, std::uint64_t seq) const {
  const auto track = tracks_.find({source.topic(), source.start_id()});
  if (track == tracks_.end()) return nullptr;
  const auto message = track->second.messages.find(logged_seq(seq));
  return message == track->second.messages.end() ? nullptr : &message->second;
}

void WaitingInputs::take(const v1::InputSource& source, std::uint64_t seq) {
  const auto track = tracks_.find({source.topic(), source.start_id()});
  if (track == tracks_.end()) return;
  std::uint64_t& taken = track->second.ports[source.port()].taken;
  taken = std::max(taken, logged_seq(seq));
}

bool WaitingInputs::was_let_go(const v1::InputSource& source, std::uint64_t seq) const {
  const auto track = tracks_.find({source.topic(), source.start_id()});
  return track != tracks_.end() && logged_seq(seq) > track->second.done &&
         logged_seq(seq) <= track->second.let_go;
}

void WaitingInputs::forget(std::uint64_t time_ns) {
  for (auto& [key, track] : tracks_) {
    std::uint64_t everywhere = ~0ull, in_queues = ~0ull;
    for (const auto& [name, port] : track.ports) {
      everywhere = std::min(everywhere, port.taken);
      if (!port.latest) in_queues = std::min(in_queues, port.taken);
    }
    track.done = std::max(track.done, everywhere);
    Messages& messages = track.messages;
    while (!messages.empty() && messages.begin()->first <= track.done) drop_first(track);
    // Inputs that keep the latest never saw a message that was replaced before the step.
    while (messages.size() > 1 && messages.begin()->first <= in_queues &&
           std::next(messages.begin())->second.log_time_ns + kLate < time_ns) {
      drop_first(track);
    }
  }
}

void WaitingInputs::drop_first(Track& track) {
  const auto first = track.messages.begin();
  track.bytes -= size_of(first->second);
  bytes_ -= size_of(first->second);
  track.messages.erase(first);
}

/// The one that holds most loses its oldest; never its newest, which is the likeliest to be taken.
void WaitingInputs::limit_bytes() {
  while (bytes_ > most_bytes_) {
    Track* largest = nullptr;
    for (auto& [key, track] : tracks_) {
      if (track.messages.size() > 1 && (largest == nullptr || track.bytes > largest->bytes)) {
        largest = &track;
      }
    }
    if (largest == nullptr) return;
    largest->let_go = largest->messages.begin()->first;
    drop_first(*largest);
  }
}

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
    count_step_logs(logs, life);
    lives.push_back(std::move(life));
  }
  return lives;
}

LifeReader::LifeReader(const std::vector<OpenLog>& logs, const Life& life,
                       std::size_t most_input_bytes)
    : logs_(logs), life_(life), inputs_(most_input_bytes), reader_(merged(logs, selection())) {}

/// Also makes the tracks, so that what is in the log at all can be told from what is missing.
log::Selection LifeReader::selection() {
  for (const v1::TopicInfo& input : life_.start.inputs()) {
    if (input.port().starts_with('.')) continue;  // the runtime's own
    inputs_.add_port(input.topic(), input.port(), input.policy() == "latest");
  }
  const auto role = [this](const log::Channel& channel) {
    const bool own =
        sender_of(channel) == life_.node() && start_id_of(channel) == life_.start.start_id();
    return std::pair(own && !runtime::is_own_topic(channel.topic),
                     own && channel.topic == life_.node() + "/steps");
  };
  for (const OpenLog& log : logs_) {
    for (const auto& [id, channel] : log.summary.channels) {
      inputs_.add_publisher(channel.topic, start_id_of(channel));
      if (role(channel).first) outputs_[channel.topic];
    }
  }
  return {.channel = [this, role](const log::Channel& channel) {
    const auto [is_output, is_steps] = role(channel);
    return is_output || is_steps || inputs_.hears(channel.topic);
  }};
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
    read_step_log(message);
    return true;
  }
  const auto kept = [&] {
    return KeptMessage{std::string(message.data), message.sequence, message.publish_time,
                       message.log_time, item->schema};
  };
  if (const auto it = outputs_.find(channel.topic);
      own && it != outputs_.end() && message.sequence > it->second.done) {
    it->second.messages.try_emplace(message.sequence, kept());
  }
  const bool before_life = message.log_time + kLate < life_.log_time_ns && !is_latched(channel);
  if (!before_life && inputs_.hears(channel.topic)) {
    inputs_.keep(channel.topic, start_id_of(channel), kept());
  }
  return true;
}

void LifeReader::read_step_log(const log::Message& message) {
  ++step_logs_read_;
  if (message.sequence <= last_step_log_seq_) return;  // two recorders heard it
  last_step_log_seq_ = message.sequence;
  v1::StepLog log;
  if (log.ParseFromArray(message.data.data(), static_cast<int>(message.data.size()))) {
    waiting_.emplace_back(message.log_time, std::move(log));
  } else {
    ++step_logs_unreadable_;
  }
}

bool LifeReader::next_step_log() {
  while (waiting_.empty() && step_logs_read_ < life_.step_logs && read()) {
  }
  if (waiting_.empty()) {
    problem_ = no_step_log();
    return false;
  }
  step_log_time_ns_ = waiting_.front().first;
  step_log_ = std::move(waiting_.front().second);
  waiting_.erase(waiting_.begin());
  next_step_ = 0;
  if (step_log_.first() != next_number_) problem_ = wrong_number();
  return problem_.empty();
}

/// Why there is no further one; empty if these were all.
std::string LifeReader::no_step_log() const {
  const std::string topic = life_.node() + "/steps";
  if (life_.step_logs == 0 && life_.other_steps > 0) {
    return fmt::format(
        "the {} messages on {} do not tell which start of the node they are of (no start_id: an "
        "older recording, or converted)",
        life_.other_steps, topic);
  }
  if (life_.step_logs == 0) return fmt::format("there is no message on {} in the log", topic);
  const std::uint64_t unread =
      life_.step_logs - std::min(life_.step_logs, step_logs_read_) + step_logs_unreadable_;
  if (unread > 0) {
    return fmt::format("{} of the {} messages on {} cannot be read", unread, life_.step_logs,
                       topic);
  }
  return next_number_ == 0 ? fmt::format("the messages on {} hold no step", topic) : "";
}

/// The steps in `step_log_` are not those that come next.
std::string LifeReader::wrong_number() const {
  const std::uint64_t first = step_log_.first();
  if (first < next_number_) return fmt::format("step {} is in the log twice", first);
  if (next_number_ > 0) {
    return fmt::format("steps {} to {} are not in the log: lost", next_number_, first - 1);
  }
  return fmt::format(
      "steps 0 to {} are not in the log: the log was begun after the node, and a replay needs the "
      "node from its constructor on",
      first - 1);
}

std::optional<RecordedStep> LifeReader::next() {
  if (!problem_.empty()) return std::nullopt;
  while (next_step_ >= step_log_.steps_size()) {
    forget();
    if (!next_step_log()) return std::nullopt;
  }
  if (!makes_sense(step_log_.steps(next_step_))) return std::nullopt;
  RecordedStep step;
  step.number = next_number_++;
  step.record = step_log_.steps(next_step_++);
  step.sources = {step_log_.sources().begin(), step_log_.sources().end()};
  return step;
}

/// A constructor, steps, perhaps a stop: a node can do nothing else.
bool LifeReader::makes_sense(const v1::StepRecord& step) {
  const bool is_first = next_number_ == 0;
  if (!v1::StepKind_IsValid(step.kind()) || step.kind() == v1::STEP_KIND_UNSPECIFIED) {
    problem_ = fmt::format("step {} is of an unknown kind ({})", next_number_,
                           static_cast<int>(step.kind()));
  } else if (is_first != (step.kind() == v1::STEP_KIND_CREATE)) {
    problem_ = is_first ? "step 0 is not the node's constructor"
                        : fmt::format("step {} is a second constructor", next_number_);
  } else if (last_kind_ == v1::STEP_KIND_STOP) {
    problem_ = fmt::format("step {} comes after the node's stop", next_number_);
  }
  last_kind_ = step.kind();
  return problem_.empty();
}

/// Reads on, as far as it may stand behind the step, until `kept` has it.
const KeptMessage* LifeReader::find(const std::function<const KeptMessage*()>& kept) {
  for (;;) {
    if (const KeptMessage* message = kept()) return message;
    if (log_time_ns_ > step_log_time_ns_ + kLate || !read()) return nullptr;
  }
}

const KeptMessage* LifeReader::input(const v1::InputSource& source, std::uint64_t seq) {
  if (!has_input(source)) return nullptr;
  const KeptMessage* message = find([&] { return inputs_.find(source, seq); });
  inputs_.take(source, seq);
  return message;
}

const KeptMessage* LifeReader::output(const std::string& topic, std::uint64_t seq) {
  const auto it = outputs_.find(topic);
  if (it == outputs_.end() || logged_seq(seq) == 0) return nullptr;
  Track& track = it->second;
  auto& messages = track.messages;
  messages.erase(messages.begin(), messages.lower_bound(logged_seq(seq)));
  track.done = logged_seq(seq) - 1;  // it may still have to be read
  const KeptMessage* message = find([&]() -> const KeptMessage* {
    const auto found = messages.find(logged_seq(seq));
    return found == messages.end() ? nullptr : &found->second;
  });
  track.done = logged_seq(seq);
  return message;
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
  inputs_.forget(step_log_time_ns_);
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
