#include "tools/mimesis/log/log_scan.h"

#include <fmt/format.h>

#include <set>

#include "common/error.h"
#include "tools/mimesis/progress.h"

namespace mimesis::tool {

std::uint64_t scan_logs(const std::vector<OpenLog>& logs, const ScanOptions& options,
                        const std::string& what,
                        const std::function<void(const log::MergedReader::Item&)>& take) {
  std::uint64_t size = 0, damages = 0;
  for (const OpenLog& log : logs) size += log.source->size();
  const Span span = span_of(logs);
  const double bytes_per_ns =
      static_cast<double>(size) /
      static_cast<double>(std::max<std::uint64_t>(1, span.end_ns - span.start_ns));
  auto reader = merged(logs, {options.channel, options.times.start, options.times.end});
  {
    Progress progress(what, size);
    while (const log::MergedReader::Item* item = reader.next()) {
      take(*item);
      const auto passed = static_cast<double>(item->message->log_time - span.start_ns);
      progress.at(static_cast<std::uint64_t>(passed * bytes_per_ns));
    }
  }
  for (std::size_t i = 0; i < logs.size() && !options.silent; ++i) {
    const log::Summary& summary = logs[i].summary;
    damages += report_damages(logs[i].path, summary.damages, summary.damage_count);
    // A file that was read as a whole has already said what the reader finds again.
    if (summary.damage_count > 0) continue;
    damages += report_damages(logs[i].path, reader.damages(i), reader.damages(i).size());
  }
  return damages;
}

std::vector<std::string> topics_of(const std::vector<OpenLog>& logs) {
  std::set<std::string> topics;
  for (const OpenLog& log : logs) {
    for (const auto& [id, channel] : log.summary.channels) topics.insert(channel.topic);
  }
  return {topics.begin(), topics.end()};
}

std::string seconds_text(std::uint64_t ns, std::uint64_t origin_ns) {
  constexpr std::uint64_t kNanoseconds = 1'000'000'000;
  const bool negative = ns < origin_ns;
  const std::uint64_t size = negative ? origin_ns - ns : ns - origin_ns;
  return fmt::format("{}{}.{:09}", negative ? "-" : "", size / kNanoseconds, size % kNanoseconds);
}

const google::protobuf::Message& LogDecoder::type(const OpenLog& log, const log::Channel& channel) {
  const auto schema = log.summary.schemas.find(channel.schema_id);
  const auto* message = type(schema == log.summary.schemas.end() ? nullptr : &schema->second);
  if (message != nullptr) return *message;
  throw ConfigError(fmt::format(
      "{}: messages are '{}', not Protobuf with a schema: they have no fields to choose",
      channel.topic, channel.message_encoding));
}

google::protobuf::Message* LogDecoder::type(const log::Schema* schema) {
  if (schema == nullptr || schema->encoding != "protobuf") return nullptr;
  const auto [it, first] = messages_.try_emplace(schema);
  if (first) it->second = types_.make(schema->name, schema->data);
  return it->second.get();
}

const google::protobuf::Message* LogDecoder::decode(const log::MergedReader::Item& item) {
  google::protobuf::Message* message = type(item.schema);
  const std::string_view bytes = item.message->data;
  if (message == nullptr ||
      !message->ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return nullptr;
  }
  return message;
}

}  // namespace mimesis::tool
