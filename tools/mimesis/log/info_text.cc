// What `mimesis log info` prints.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tools/mimesis/log/byte_size.h"
#include "tools/mimesis/log/human.h"
#include "tools/mimesis/log/info.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using nlohmann::ordered_json;

double duration_s(const log::Statistics& s) {
  return static_cast<double>(s.message_end_time - s.message_start_time) * 1e-9;
}

ordered_json files_json(const std::vector<OpenLog>& logs) {
  ordered_json files = ordered_json::array();
  for (const OpenLog& log : logs) {
    const log::Statistics& s = log.summary.statistics;
    files.push_back({{"file", log.path},
                     {"size", log.source->size()},
                     {"library", log.summary.header.library},
                     {"closed", log.summary.from_file},
                     {"messages", s.message_count},
                     {"start_ns", s.message_start_time},
                     {"end_ns", s.message_end_time}});
  }
  return files;
}

ordered_json topics_json(const LogSummary& summary) {
  ordered_json topics = ordered_json::array();
  for (const TopicSummary& t : summary.topics) {
    ordered_json topic{
        {"topic", t.topic},          {"type", t.type},         {"node", t.node},
        {"encoding", t.encoding},    {"messages", t.messages}, {"rate_hz", summary.rate_hz(t)},
        {"starts", t.starts.size()}, {"metadata", t.metadata}};
    topic["lost"] = t.losses ? ordered_json(t.losses->lost) : ordered_json(nullptr);
    topic["bytes"] = t.bytes ? ordered_json(*t.bytes) : ordered_json(nullptr);
    topics.push_back(std::move(topic));
  }
  return topics;
}

void print_files(const std::vector<OpenLog>& logs, bool colour, std::ostream& out) {
  Table table({"FILE", "SIZE", "MESSAGES", "FROM", "SECONDS", ""});
  for (const OpenLog& log : logs) {
    const log::Statistics& s = log.summary.statistics;
    table.row({log.path, bytes_text(log.source->size()), std::to_string(s.message_count),
               human_time(s.message_start_time), fmt::format("{:.3f}", duration_s(s)),
               log.summary.from_file ? "" : "not closed"});
  }
  table.print(out, colour);
  out << '\n';
}

void print_topics(const LogSummary& summary, bool colour, std::ostream& out) {
  const bool sizes = !summary.topics.empty() && summary.topics.front().bytes.has_value();
  std::vector<std::string> heading{"TOPIC", "TYPE", "NODE", "MESSAGES", "LOST", "HZ"};
  if (sizes) heading.insert(heading.end(), {"BYTES", "SHARE"});
  std::uint64_t total = 0;
  for (const TopicSummary& t : summary.topics) total += t.bytes.value_or(0);
  Table table(std::move(heading));
  for (const TopicSummary& t : summary.topics) {
    std::vector<std::string> cells{t.topic,
                                   t.type,
                                   t.node,
                                   std::to_string(t.messages),
                                   t.losses ? std::to_string(t.losses->lost) : "?",
                                   fmt::format("{:.1f}", summary.rate_hz(t))};
    if (sizes) {
      const std::uint64_t bytes = t.bytes.value_or(0);
      cells.push_back(bytes_text(bytes));
      cells.push_back(fmt::format(
          "{:.1f} %",
          total == 0 ? 0.0 : 100.0 * static_cast<double>(bytes) / static_cast<double>(total)));
    }
    table.row(std::move(cells));
  }
  table.print(out, colour);
}

/// Short lists in one line; of whole files the beginning: mimesis log cat --metadata prints them.
std::string in_one_line(const std::string& text) {
  constexpr std::size_t kLongest = 200;
  std::string line;
  for (const char c : text.substr(0, kLongest))
    line += c == '\n' ? std::string(", ") : std::string(1, c);
  if (line.ends_with(", ")) line.resize(line.size() - 2);
  return text.size() > kLongest ? fmt::format("{} ... ({} bytes)", line, text.size()) : line;
}

std::string nodes_text(const LogSummary& summary) {
  std::string text;
  for (const auto& [name, node] : summary.nodes) {
    if (name.empty()) continue;
    text += (text.empty() ? "" : ", ") + name;
    if (node.starts.size() > 1) text += fmt::format(" (started {} times)", node.starts.size());
  }
  return text;
}

}  // namespace

ordered_json info_json(const std::vector<OpenLog>& logs, const LogSummary& summary) {
  const OpenLog& first = logs.front();
  ordered_json out{
      {"file", first.path},
      {"size", summary.size},
      {"library", first.summary.header.library},
      {"closed", std::ranges::all_of(logs, [](const OpenLog& l) { return l.summary.from_file; })},
      {"messages", summary.messages},
      {"start_ns", summary.span.start_ns},
      {"end_ns", summary.span.end_ns},
      {"duration_s", summary.duration_s()},
      {"chunks", summary.chunks},
      {"compression", summary.compressions},
      {"compressed_size", summary.compressed},
      {"uncompressed_size", summary.uncompressed},
      {"files", files_json(logs)},
      {"topics", topics_json(summary)},
      {"nodes", ordered_json::array()},
      {"attachments", ordered_json::array()},
      {"metadata", ordered_json::array()},
      {"damages", ordered_json::array()}};
  out["lost"] = summary.lost ? ordered_json(*summary.lost) : ordered_json(nullptr);
  for (const auto& [name, node] : summary.nodes) {
    if (name.empty()) continue;
    out["nodes"].push_back({{"node", name},
                            {"topics", node.topics},
                            {"messages", node.messages},
                            {"starts", node.starts}});
  }
  for (const auto& [name, values] : summary.metadata) {
    out["metadata"].push_back({{"name", name}, {"values", values}});
  }
  for (const OpenLog& log : logs) {
    for (const auto& a : log.summary.attachments) {
      out["attachments"].push_back({{"file", log.path},
                                    {"name", a.name},
                                    {"media_type", a.media_type},
                                    {"size", a.data_size}});
    }
    for (const auto& d : log.summary.damages) {
      out["damages"].push_back({{"file", log.path}, {"offset", d.offset}, {"what", d.what}});
    }
  }
  return out;
}

std::string info_text(const std::vector<OpenLog>& logs, const LogSummary& summary, bool colour) {
  std::ostringstream out;
  const auto line = [&](std::string_view label, const std::string& value) {
    out << fmt::format("{:<12} {}\n", label, value);
  };
  if (logs.size() > 1) print_files(logs, colour, out);
  const OpenLog& first = logs.front();
  if (logs.size() == 1) {
    line("file",
         fmt::format("{} ({}{})", first.path, bytes_text(summary.size),
                     first.summary.from_file ? "" : ", without a summary: read as a whole"));
  } else {
    line("files", fmt::format("{} ({})", logs.size(), bytes_text(summary.size)));
  }
  line("library", first.summary.header.library);
  line("messages", fmt::format("{} on {} topics", summary.messages, summary.topics.size()));
  line("lost", summary.lost ? std::to_string(*summary.lost) : "not counted");
  line("time", fmt::format("{} to {} ({:.3f} s)", human_time(summary.span.start_ns),
                           human_time(summary.span.end_ns), summary.duration_s()));
  line("chunks",
       fmt::format("{}, {}, {} of {} ({:.2f} : 1)", summary.chunks,
                   fmt::join(summary.compressions, ", "), bytes_text(summary.compressed),
                   bytes_text(summary.uncompressed),
                   summary.compressed == 0 ? 1.0
                                           : static_cast<double>(summary.uncompressed) /
                                                 static_cast<double>(summary.compressed)));
  if (const std::string nodes = nodes_text(summary); !nodes.empty()) line("nodes", nodes);
  for (const OpenLog& log : logs) {
    for (const auto& a : log.summary.attachments) {
      line("attachment", fmt::format("{} ({}, {})", a.name, a.media_type, bytes_text(a.data_size)));
    }
  }
  for (const auto& [name, values] : summary.metadata) {
    if (name.starts_with(kCountsName)) continue;  // column LOST
    line("metadata", name);
    for (const auto& [key, value] : values) line("", key + ": " + in_one_line(value));
  }
  out << '\n';
  print_topics(summary, colour, out);
  return out.str();
}

}  // namespace mimesis::tool
