#include "tools/mimesis/log/open_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cinttypes>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <set>

#include "common/error.h"
#include "common/runtime/value_text.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

constexpr double kLatest_s = 1e10;  // 300 years: no time in a log is later
constexpr std::uint64_t kSecond_ns = 1'000'000'000;

std::string metadata_value(const log::Channel& channel, const std::string& key) {
  const auto it = channel.metadata.find(key);
  return it == channel.metadata.end() ? "" : it->second;
}

/// "2026-11-21T15:40:00.25Z", with ' ' for T, without fraction or Z.
std::optional<std::uint64_t> utc_ns(const std::string& text) {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, used = 0;
  char between = 0;
  if (std::sscanf(text.c_str(), "%4d-%2d-%2d%c%2d:%2d:%n", &year, &month, &day, &between, &hour,
                  &minute, &used) != 6 ||
      used == 0 || (between != 'T' && between != ' ')) {
    return std::nullopt;
  }
  std::string seconds = text.substr(static_cast<std::size_t>(used));
  if (seconds.ends_with('Z')) seconds.pop_back();
  const auto second = runtime::to_double(seconds);
  using namespace std::chrono;
  const year_month_day date{std::chrono::year{year},
                            std::chrono::month(static_cast<unsigned>(month)),
                            std::chrono::day(static_cast<unsigned>(day))};
  if (!second || *second < 0.0 || *second >= 61.0 || !date.ok() || year < 1970 || hour > 23 ||
      minute > 59) {
    return std::nullopt;
  }
  const auto whole = sys_days(date).time_since_epoch() + hours(hour) + minutes(minute);
  return static_cast<std::uint64_t>(duration_cast<nanoseconds>(whole).count()) +
         static_cast<std::uint64_t>(std::llround(*second * 1e9));
}

/// "2.5", "500ms", "2min".
std::optional<std::uint64_t> relative_ns(const std::string& text) {
  if (const auto duration = runtime::to_duration(text)) {
    return static_cast<std::uint64_t>(duration->count());
  }
  const auto seconds = runtime::to_double(text);
  if (!seconds || *seconds < 0.0 || *seconds > kLatest_s) return std::nullopt;
  return static_cast<std::uint64_t>(std::llround(*seconds * 1e9));
}

/// Unpacked bytes of the chunks that a selection touches.
std::uint64_t payload_bytes(const std::vector<OpenLog>& logs, const log::Selection& selection) {
  std::uint64_t total = 0;
  for (const OpenLog& log : logs) {
    for (const log::Segment& s : log.summary.segments) {
      const bool wanted = s.index.message_end_time >= selection.start_time &&
                          s.index.message_start_time < selection.end_time;
      total += wanted ? s.index.uncompressed_size : 0;
    }
  }
  return total;
}

}  // namespace

OpenLog open_log(const std::string& path) {
  auto source = log::open_file(path);
  if (!source) {
    const bool there = std::filesystem::exists(std::filesystem::status(path));
    throw VerbEnd{source.error().reason, there ? 1 : 3};
  }
  auto summary = log::summarize(**source);
  if (summary && !summary->counted) summary = log::scan(**source);
  if (!summary) throw VerbEnd{path + ": " + summary.error().reason, 1};
  return {path, std::move(*source), std::move(*summary)};
}

std::vector<OpenLog> open_logs(const std::vector<std::string>& paths) {
  std::vector<OpenLog> logs;
  for (const std::string& path : paths) logs.push_back(open_log(path));
  return logs;
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

std::string sender_of(const log::Channel& channel) { return metadata_value(channel, "node"); }

std::string start_of(const log::Channel& channel) { return metadata_value(channel, "start_id"); }

bool is_latched(const log::Channel& channel) {
  return metadata_value(channel, "latched") == "true";
}

std::vector<OpenChannel> channels_of(const OpenLog& log) {
  std::vector<OpenChannel> all;
  for (const auto& [id, channel] : log.summary.channels) {
    const auto schema = log.summary.schemas.find(channel.schema_id);
    all.push_back(
        {&log, &channel, schema == log.summary.schemas.end() ? nullptr : &schema->second});
  }
  return all;
}

std::vector<OpenChannel> channels_of(const std::vector<OpenLog>& logs) {
  std::vector<OpenChannel> all;
  for (const OpenLog& log : logs) {
    const auto more = channels_of(log);
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

std::vector<std::string> topics_of(const std::vector<OpenLog>& logs) {
  std::set<std::string> topics;
  for (const OpenChannel& c : channels_of(logs)) topics.insert(c.channel->topic);
  return {topics.begin(), topics.end()};
}

void require_topic(const std::vector<OpenLog>& logs, const std::string& topic) {
  const auto topics = topics_of(logs);
  if (std::ranges::find(topics, topic) != topics.end()) return;
  throw ConfigError("no topic '" + topic + "' in the log" + runtime::did_you_mean(topic, topics));
}

std::uint64_t each_metadata(const std::vector<OpenLog>& logs, const std::string& name,
                            const std::function<void(const log::Metadata&)>& take, bool silent) {
  std::uint64_t failures = 0;
  for (const OpenLog& log : logs) {
    for (const log::MetadataIndex& index : log.summary.metadata) {
      if (!name.empty() && index.name != name) continue;
      if (const auto record = log::read_metadata(*log.source, index)) {
        take(*record);
      } else {
        if (!silent) std::cerr << log.path << ": " << printable(record.error().reason) << '\n';
        ++failures;
      }
    }
  }
  return failures;
}

std::uint64_t parse_log_time(const std::string& option, const std::string& text, const Span& span) {
  if (text.ends_with("ns")) {
    const std::string_view digits = std::string_view(text).substr(0, text.size() - 2);
    if (const auto ns = runtime::to_whole<std::uint64_t>(digits)) return *ns;
  } else if (const auto ns = relative_ns(text)) {
    return span.start_ns + *ns;
  } else if (const auto utc = utc_ns(text)) {
    return *utc;
  }
  throw ConfigError(fmt::format(
      "{}: expected seconds from the first message (12.5), a log time (12500000000ns) or "
      "a time in UTC (2026-11-21T15:40:00.5Z), found '{}'",
      option, text));
}

LogTimes resolve(const TimeRange& range, const Span& span) {
  LogTimes times;
  if (!range.start.empty()) times.start = parse_log_time("--start", range.start, span);
  if (!range.end.empty()) times.end = parse_log_time("--end", range.end, span);
  if (!range.duration.empty()) {
    if (!range.end.empty()) throw ConfigError("give --end or --duration, not both");
    const auto ns = relative_ns(range.duration);
    if (!ns) {
      throw ConfigError(fmt::format(
          "--duration: expected seconds (2.5) or a duration (2min), found '{}'", range.duration));
    }
    times.end = std::max(times.start, span.start_ns) + *ns;
  }
  if (times.end <= times.start) {
    throw ConfigError(
        fmt::format("the part of the log is empty: it starts at {} ns and ends at {} ns",
                    times.start, times.end));
  }
  return times;
}

std::string seconds_text(std::uint64_t ns, std::uint64_t origin_ns) {
  const bool negative = ns < origin_ns;
  const std::uint64_t size = negative ? origin_ns - ns : ns - origin_ns;
  return fmt::format("{}{}.{:09}", negative ? "-" : "", size / kSecond_ns, size % kSecond_ns);
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

LogProgress::LogProgress(const std::string& what, const std::vector<OpenLog>& logs,
                         const log::Selection& selection)
    : span_(span_of(logs)), total_(payload_bytes(logs, selection)), bar_(what, total_) {
  span_.start_ns = std::max(span_.start_ns, selection.start_time);
  span_.end_ns = std::min(span_.end_ns, selection.end_time);
}

void LogProgress::at(std::uint64_t log_time_ns) {
  if (log_time_ns <= span_.start_ns || span_.end_ns <= span_.start_ns) return bar_.at(0);
  const double share = static_cast<double>(log_time_ns - span_.start_ns) /
                       static_cast<double>(span_.end_ns - span_.start_ns);
  bar_.at(static_cast<std::uint64_t>(std::min(share, 1.0) * static_cast<double>(total_)));
}

std::uint64_t report_damages(const std::string& path, const std::vector<log::Damage>& damages,
                             std::uint64_t count) {
  for (const log::Damage& d : damages)
    std::cerr << fmt::format("{}: byte {}: {}\n", path, d.offset, printable(d.what));
  if (count > damages.size())
    std::cerr << fmt::format("{}: and {} more\n", path, count - damages.size());
  return count;
}

std::uint64_t report_damages(const OpenLog& log, const std::vector<log::Damage>& met) {
  const log::Summary& summary = log.summary;
  if (summary.damage_count == 0) return report_damages(log.path, met, met.size());
  return report_damages(log.path, summary.damages, summary.damage_count);
}

std::uint64_t report_losses(const OpenLog& log, const std::vector<log::Damage>& damages,
                            std::uint64_t count) {
  report_damages(log.path, damages, count);
  const auto harmless = std::ranges::count_if(
      damages, [&](const log::Damage& d) { return d.offset >= log.source->size(); });
  return count - static_cast<std::uint64_t>(harmless);
}

std::uint64_t scan_logs(const std::vector<OpenLog>& logs, const log::Selection& selection,
                        const std::string& what, const std::function<void(const Item&)>& take,
                        bool silent) {
  auto reader = merged(logs, selection);
  {
    LogProgress progress(what, logs, selection);
    while (const Item* item = reader.next()) {
      take(*item);
      progress.at(item->message->log_time);
    }
  }
  std::uint64_t damages = 0;
  for (std::size_t i = 0; i < logs.size() && !silent; ++i) {
    damages += report_damages(logs[i], reader.damages(i));
  }
  return damages;
}

std::uint64_t overlap_bytes(const log::Summary& summary) {
  // time, change of the bytes in use
  std::vector<std::pair<std::uint64_t, std::int64_t>> edges;
  for (const log::Segment& s : summary.segments) {
    const auto size = static_cast<std::int64_t>(
        std::min<std::uint64_t>(s.index.uncompressed_size, log::ReaderLimits{}.chunk_size));
    edges.emplace_back(s.index.message_start_time, size);
    edges.emplace_back(s.index.message_end_time, -size);
  }
  // At equal times the larger first: what begins before what ends.
  std::ranges::sort(edges, [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : a.second > b.second;
  });
  std::int64_t now = 0, most = 0;
  for (const auto& [time, change] : edges) most = std::max(most, now += change);
  return static_cast<std::uint64_t>(most);
}

std::string loss_key(const log::Channel& channel) {
  return fmt::format("{} ({})", channel.topic, sender_of(channel));
}

void add_losses(const std::map<std::string, std::string>& metadata, LossCounts& counts) {
  for (const auto& [key, text] : metadata) {
    LossCount count;
    int used = 0;
    const int found = std::sscanf(text.c_str(), "received=%" SCNu64 " lost=%" SCNu64 "%n",
                                  &count.received, &count.lost, &used);
    if (found != 2 || static_cast<std::size_t>(used) != text.size() || key == "total") continue;
    counts[key].received += count.received;
    counts[key].lost += count.lost;
  }
}

std::optional<LossCounts> read_losses(const std::vector<OpenLog>& logs) {
  std::optional<LossCounts> counts;
  const auto add = [&](const log::Metadata& metadata) {
    if (!counts) counts.emplace();
    add_losses(metadata.metadata, *counts);
  };
  each_metadata(logs, kCountsName, add, /*silent=*/true);
  return counts;
}

}  // namespace mimesis::tool
