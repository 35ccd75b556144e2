#include "tools/mimesis/log/info.h"

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <tuple>
#include <unordered_map>

#include "tools/mimesis/log/rewriting.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using nlohmann::ordered_json;

std::uint64_t count_of(const log::Summary& summary, std::uint16_t id) {
  const auto it = summary.statistics.channel_message_counts.find(id);
  return it == summary.statistics.channel_message_counts.end() ? 0 : it->second;
}

/// Payload bytes per channel: takes reading it all.
std::unordered_map<const log::Channel*, std::uint64_t> payloads(const std::vector<OpenLog>& logs) {
  std::unordered_map<const log::Channel*, std::uint64_t> bytes;
  Progress progress("info", payload_bytes(logs, {}));
  log::MergedReader reader = merged(logs);
  std::uint64_t done = 0;
  while (const log::MergedReader::Item* item = reader.next()) {
    bytes[item->channel] += item->message->data.size();
    progress.at(done += item->message->data.size());
  }
  for (std::size_t i = 0; i < logs.size(); ++i) {
    report_losses(logs[i], reader.damages(i), reader.damages(i).size());
  }
  return bytes;
}

void add_chunks(const log::Summary& from, LogSummary& out) {
  for (const log::Segment& segment : from.segments) {
    out.chunks += segment.bare ? 0 : 1;
    out.compressed += segment.index.compressed_size;
    out.uncompressed += segment.index.uncompressed_size;
    out.compressions.insert(segment.index.compression.empty() ? "none" : segment.index.compression);
  }
}

void add_metadata(const OpenLog& log, LogSummary& out) {
  for (const log::MetadataIndex& index : log.summary.metadata) {
    const auto read = log::read_metadata(*log.source, index);
    if (!read) {
      std::cerr << log.path << ": " << read.error().reason << '\n';
      continue;
    }
    std::pair entry{read->name, read->metadata};
    if (std::ranges::find(out.metadata, entry) == out.metadata.end()) {
      out.metadata.push_back(std::move(entry));
    }
  }
}

}  // namespace

double LogSummary::duration_s() const {
  return static_cast<double>(span.end_ns - span.start_ns) * 1e-9;
}

double LogSummary::rate_hz(const TopicSummary& topic) const {
  return duration_s() > 0.0 ? static_cast<double>(topic.messages) / duration_s() : 0.0;
}

LogSummary summarize_logs(const std::vector<OpenLog>& logs, bool sizes) {
  LogSummary out;
  out.span = span_of(logs);
  const auto losses = read_losses(logs);
  const auto bytes =
      sizes ? payloads(logs) : std::unordered_map<const log::Channel*, std::uint64_t>{};
  std::map<std::tuple<std::string, std::string, std::string>, std::size_t> places;
  for (const OpenLog& log : logs) {
    out.size += log.source->size();
    out.messages += log.summary.statistics.message_count;
    add_chunks(log.summary, out);
    add_metadata(log, out);
    for (const auto& [id, channel] : log.summary.channels) {
      const auto schema = log.summary.schemas.find(channel.schema_id);
      const std::string type = schema == log.summary.schemas.end() ? "" : schema->second.name;
      const std::string node = sender_of(channel), start = start_of(channel);
      const auto [place, fresh] =
          places.try_emplace({channel.topic, node, type}, out.topics.size());
      if (fresh) {
        out.topics.push_back(
            {channel.topic, type, node, channel.message_encoding, channel.metadata, {}, 0, {}, {}});
      }
      TopicSummary& topic = out.topics[place->second];
      const std::uint64_t count = count_of(log.summary, id);
      topic.messages += count;
      const auto size = bytes.find(&channel);
      if (sizes) topic.bytes = topic.bytes.value_or(0) + (size == bytes.end() ? 0 : size->second);
      if (losses && losses->contains(loss_key(channel)))
        topic.losses = losses->at(loss_key(channel));
      NodeSummary& sender = out.nodes[node];
      sender.topics.insert(channel.topic);
      sender.messages += count;
      if (start.empty()) continue;
      topic.starts.insert(start);
      sender.starts.insert(start);
    }
  }
  std::ranges::sort(out.topics, {},
                    [](const TopicSummary& t) { return std::tie(t.topic, t.node); });
  if (losses) {
    out.lost = 0;
    for (const auto& [key, count] : *losses) *out.lost += count.lost;
  }
  return out;
}

int log_info(const std::vector<std::string>& paths, bool sizes, bool json) {
  const auto logs = open_logs(paths);
  if (!logs) {
    std::cerr << logs.error().line << '\n';
    return logs.error().exit_code;
  }
  const LogSummary summary = summarize_logs(*logs, sizes);
  if (json) {
    std::cout
        << info_json(*logs, summary).dump(-1, ' ', false, ordered_json::error_handler_t::replace)
        << '\n';
  } else {
    std::cout << info_text(*logs, summary, use_colour(1));
  }
  for (const OpenLog& log : *logs) {
    report_damages(log.path, log.summary.damages, log.summary.damage_count);
  }
  return 0;
}

}  // namespace mimesis::tool
