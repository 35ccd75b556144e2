#include "tools/mimesis/log/recover.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/log/stream_reader.h"
#include "tools/mimesis/log/loss_counts.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/stop_signals.h"

namespace mimesis::tool {
namespace {

class Recovery {
 public:
  Recovery(const log::Source& in, const log::Summary& summary, NewLog& out)
      : in_(in), summary_(summary), reader_(in), out_(out) {}

  tl::expected<Recovered, Status> run();

 private:
  log::Result take(const log::Record& record);
  log::Result take_message(const log::Message& message);
  tl::expected<std::uint16_t, Status> channel(std::uint16_t id);
  void follow(const log::Message& message);
  void conclude();
  log::Result note_losses();

  const log::Source& in_;
  const log::Summary& summary_;  ///< definitions that stand behind the messages that need them
  log::StreamReader reader_;
  NewLog& out_;
  Recovered result_;
  std::map<std::uint16_t, std::uint16_t> ids_;  ///< input -> output; void after a new definition
  std::optional<std::uint64_t> data_end_;
  std::optional<log::Statistics> statistics_;
};

tl::expected<Recovered, Status> Recovery::run() {
  const StopSignals stop;
  Progress progress("recover", in_.size());
  while (const log::Record* record = reader_.next()) {
    if (stop.requested()) {
      result_.interrupted = true;
      return result_;
    }
    if (auto done = take(*record); !done) return tl::unexpected(done.error());
    progress.at(reader_.offset());
  }
  conclude();
  if (auto done = note_losses(); !done) return tl::unexpected(done.error());
  return result_;
}

log::Result Recovery::take(const log::Record& record) {
  if (const auto* message = std::get_if<log::Message>(&record)) return take_message(*message);
  if (std::holds_alternative<log::Schema>(record) || std::holds_alternative<log::Channel>(record)) {
    ids_.clear();
  } else if (const auto* attachment = std::get_if<log::Attachment>(&record)) {
    ++result_.attachments;
    return out_.attach(*attachment);
  } else if (const auto* metadata = std::get_if<log::Metadata>(&record)) {
    ++result_.metadata;
    return out_.add_metadata(*metadata);
  } else if (std::holds_alternative<log::DataEnd>(record)) {
    data_end_ = reader_.offset();
  } else if (const auto* statistics = std::get_if<log::Statistics>(&record)) {
    statistics_ = *statistics;
  }
  return {};
}

log::Result Recovery::take_message(const log::Message& message) {
  const auto id = channel(message.channel_id);
  if (!id) return tl::unexpected(id.error());
  follow(message);
  log::Message copy = message;
  copy.channel_id = *id;
  return out_.write(copy);
}

/// Id in the output. A channel whose definition is nowhere in the file gets a name from its id.
tl::expected<std::uint16_t, Status> Recovery::channel(std::uint16_t id) {
  if (const auto known = ids_.find(id); known != ids_.end()) return known->second;
  const auto find = [](const auto& first, const auto& second, std::uint16_t key) {
    const auto it = first.find(key);
    if (it != first.end()) return &it->second;
    const auto other = second.find(key);
    return other == second.end() ? nullptr : &other->second;
  };
  const log::Channel* defined = find(reader_.channels(), summary_.channels, id);
  log::Channel placeholder;
  placeholder.topic = fmt::format("unknown/channel_{}", id);
  const log::Channel& chosen = defined == nullptr ? placeholder : *defined;
  const log::Schema* schema = find(reader_.schemas(), summary_.schemas, chosen.schema_id);
  const auto out = out_.channel(chosen, schema);
  if (!out) return out;
  RecoveredTopic& topic = result_.topics[id];
  topic.topic = chosen.topic;
  topic.node = sender_of(chosen);
  topic.placeholder = defined == nullptr;
  ids_.emplace(id, *out);
  return out;
}

void Recovery::follow(const log::Message& message) {
  RecoveredTopic& topic = result_.topics.at(message.channel_id);
  const std::uint64_t damages = reader_.damage_count();
  const Sequence::Step step =
      message.sequence == 0 ? Sequence::Step{} : topic.sequence.next(message.sequence);
  if (step.missing > 0) {
    topic.missing.push_back({message.sequence - step.missing, step.missing, topic.last_ns,
                             message.log_time, damages > topic.damages_before});
  }
  ++topic.messages;
  topic.last_ns = message.log_time;
  topic.damages_before = damages;
}

void Recovery::conclude() {
  result_.damages = reader_.damages();
  result_.damage_count = reader_.damage_count();
  result_.complete = reader_.complete();
  if (statistics_) {
    for (const auto& [id, count] : statistics_->channel_message_counts) {
      if (count == 0) continue;
      RecoveredTopic& topic = result_.topics[id];
      topic.expected = count;
      result_.lost |= topic.messages != count;
      if (!topic.topic.empty()) continue;  // else: not one message could be read
      const auto channel = summary_.channels.find(id);
      const bool known = channel != summary_.channels.end();
      topic.topic = known ? channel->second.topic : fmt::format("unknown/channel_{}", id);
      topic.node = known ? sender_of(channel->second) : "";
      topic.placeholder = !known;
    }
  }
  // Behind the data stands only what can be made again; a file may end where a record does.
  const std::uint64_t data_end = data_end_.value_or(in_.size());
  result_.lost |= result_.damage_count > result_.damages.size();
  for (const log::Damage& d : result_.damages) result_.lost |= d.offset < data_end;
  const bool data_sum_wrong = std::ranges::any_of(
      result_.damages, [&](const log::Damage& d) { return data_end_ && d.offset == *data_end_; });
  result_.lost |= data_sum_wrong;
}

/// Into the output: whoever checks it later knows why its counts do not fit.
log::Result Recovery::note_losses() {
  if (!result_.lost) return {};
  log::Metadata note{kRecoveredName, {{"damages", std::to_string(result_.damage_count)}}};
  for (const auto& [id, topic] : result_.topics) {
    if (topic.expected.value_or(0) <= topic.messages) continue;
    note.metadata[fmt::format("{} ({})", topic.topic, topic.node)] =
        fmt::format("missing={}", *topic.expected - topic.messages);
  }
  return out_.add_metadata(note);
}

}  // namespace

tl::expected<Recovered, Status> recover(const log::Source& in, const log::Summary& summary,
                                        NewLog& out) {
  return Recovery(in, summary, out).run();
}

}  // namespace mimesis::tool
