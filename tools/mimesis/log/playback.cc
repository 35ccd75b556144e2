#include "tools/mimesis/log/playback.h"

#include <fmt/format.h>

#include <algorithm>

namespace mimesis::tool {
namespace {

std::uint64_t ns(double seconds) { return static_cast<std::uint64_t>(seconds * 1e9); }

}  // namespace

Playback::Playback(const std::string& path, PlaybackOptions options) {
  auto source = log::open_file(path);
  if (!source) throw ConfigError(source.error().reason);
  source_ = std::move(*source);
  auto summary = log::summarize(*source_);
  if (!summary) throw ConfigError(fmt::format("{}: {}", path, summary.error().reason));
  summary_ = std::move(*summary);
  find_topics(options);
  if (topics_.empty()) throw ConfigError(fmt::format("{}: none of its topics is selected", path));

  const log::Statistics& s = summary_.statistics;
  start_ns_ = s.message_start_time + ns(std::max(0.0, options.start_s));
  end_ns_ = s.message_end_time;
  if (options.duration_s >= 0.0) end_ns_ = std::min(end_ns_, start_ns_ + ns(options.duration_s));
  if (start_ns_ > end_ns_) {
    throw ConfigError(fmt::format(
        "{}: it lasts {:.3f} s, nothing is left after --start {:.3f}", path,
        static_cast<double>(s.message_end_time - s.message_start_time) * 1e-9, options.start_s));
  }
  find_latched();
  rewind();
}

void Playback::find_topics(const PlaybackOptions& options) {
  const auto counts = summary_.statistics.channel_message_counts;
  for (const auto& [id, channel] : summary_.channels) {
    if (options.topic && !options.topic(channel.topic)) continue;
    const auto schema = summary_.schemas.find(channel.schema_id);
    if (schema == summary_.schemas.end() || schema->second.encoding != "protobuf") continue;
    const auto latched = channel.metadata.find("latched");
    const auto count = counts.find(id);
    const PlayedTopic topic{channel.topic, schema->second.name, schema->second.data,
                            latched != channel.metadata.end() && latched->second == "true",
                            count == counts.end() ? 0 : count->second};
    auto same = std::ranges::find(topics_, topic.topic, &PlayedTopic::topic);
    if (same == topics_.end()) {
      topics_.push_back(topic);
      same = topics_.end() - 1;
    } else if (same->type != topic.type) {
      throw ConfigError(fmt::format("topic {} has two types in this log: {} and {}; --exclude it",
                                    topic.topic, same->type, topic.type));
    } else {
      same->messages += topic.messages;
    }
    by_channel_[id] = static_cast<std::size_t>(same - topics_.begin());
  }
}

log::Selection Playback::selection(std::uint64_t from, std::uint64_t to, bool only_latched) const {
  return {[this, only_latched](const log::Channel& channel) {
            const auto it = by_channel_.find(channel.id);
            return it != by_channel_.end() && (!only_latched || topics_[it->second].latched);
          },
          from, to};
}

void Playback::find_latched() {
  if (start_ns_ == summary_.statistics.message_start_time) return;
  log::IndexedReader before(*source_, summary_, selection(0, start_ns_, true));
  std::map<std::size_t, std::pair<std::uint64_t, std::string>> last;  // by topic: order, payload
  std::uint64_t order = 0;
  while (const log::Message* m = before.next()) {
    last[by_channel_.at(m->channel_id)] = {order++, std::string(m->data)};
  }
  std::vector<std::pair<std::uint64_t, std::size_t>> sorted;
  for (const auto& [topic, value] : last) sorted.emplace_back(value.first, topic);
  std::ranges::sort(sorted);
  for (const auto& [when, topic] : sorted) {
    latched_.emplace_back(&topics_[topic], std::move(last[topic].second));
  }
}

void Playback::rewind() {
  reader_ = std::make_unique<log::IndexedReader>(*source_, summary_,
                                                 selection(start_ns_, end_ns_ + 1, false));
}

bool Playback::next(Played& out) {
  const log::Message* m = reader_->next();
  if (m == nullptr) return false;
  out = {&topics_[by_channel_.at(m->channel_id)], m->log_time, m->publish_time, m->data};
  return true;
}

std::vector<log::Damage> Playback::damages() const {
  std::vector<log::Damage> all = summary_.damages;
  all.insert(all.end(), reader_->damages().begin(), reader_->damages().end());
  return all;
}

}  // namespace mimesis::tool
