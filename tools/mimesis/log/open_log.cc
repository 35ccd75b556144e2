#include "tools/mimesis/log/open_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>

namespace mimesis::tool {
namespace {

std::string value_of(const log::Channel& channel, const std::string& key) {
  const auto it = channel.metadata.find(key);
  return it == channel.metadata.end() ? "" : it->second;
}

}  // namespace

tl::expected<OpenLog, OpenError> open_log(const std::string& path) {
  auto source = log::open_file(path);
  if (!source) {
    const bool there = std::filesystem::exists(std::filesystem::status(path));
    return tl::unexpected(OpenError{source.error().reason, there ? 1 : 3});
  }
  auto summary = log::summarize(**source);
  if (summary && !summary->counted) summary = log::scan(**source);
  if (!summary) return tl::unexpected(OpenError{path + ": " + summary.error().reason, 1});
  return OpenLog{path, std::move(*source), std::move(*summary)};
}

tl::expected<std::vector<OpenLog>, OpenError> open_logs(const std::vector<std::string>& paths) {
  std::vector<OpenLog> logs;
  for (const std::string& path : paths) {
    auto log = open_log(path);
    if (!log) return tl::unexpected(log.error());
    logs.push_back(std::move(*log));
  }
  return logs;
}

log::MergedReader merged(const std::vector<OpenLog>& logs, const log::Selection& selection,
                         const std::vector<std::int64_t>& offsets_ns) {
  std::vector<log::MergedReader::Input> inputs;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    inputs.push_back(
        {logs[i].source.get(), &logs[i].summary, i < offsets_ns.size() ? offsets_ns[i] : 0});
  }
  return {std::move(inputs), selection};
}

Span span_of(const std::vector<OpenLog>& logs) {
  Span span;
  bool any = false;
  for (const OpenLog& log : logs) {
    const log::Statistics& s = log.summary.statistics;
    if (s.message_count == 0) continue;
    span.start_ns = any ? std::min(span.start_ns, s.message_start_time) : s.message_start_time;
    span.end_ns = std::max(span.end_ns, s.message_end_time);
    any = true;
  }
  return span;
}

std::string sender_of(const log::Channel& channel) { return value_of(channel, "node"); }

std::string start_of(const log::Channel& channel) { return value_of(channel, "start_id"); }

bool is_latched(const log::Channel& channel) { return value_of(channel, "latched") == "true"; }

std::uint64_t report_damages(const std::string& path, const std::vector<log::Damage>& damages,
                             std::uint64_t count) {
  for (const log::Damage& d : damages)
    std::cerr << fmt::format("{}: byte {}: {}\n", path, d.offset, d.what);
  if (count > damages.size())
    std::cerr << fmt::format("{}: and {} more\n", path, count - damages.size());
  return count;
}

}  // namespace mimesis::tool
