#include "tools/mimesis/log/info.h"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <sstream>
#include <tuple>
#include <unordered_map>

#include "tools/mimesis/log/human.h"
#include "tools/mimesis/log/new_log.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using nlohmann::ordered_json;

std::uint64_t count_of(const log::Summary& summary, std::uint16_t id) {
  const auto it = summary.statistics.channel_message_counts.find(id);
  return it == summary.statistics.channel_message_counts.end() ? 0 : it->second;
}

void add_chunks(const log::Summary& from, LogSummary& out) {
  for (const log::Segment& segment : from.segments) {
    out.chunks += segment.bare ? 0 : 1;
    out.compressed += segment.index.compressed_size;
    out.uncompressed += segment.index.uncompressed_size;
    out.compressions.insert(segment.index.compression.empty() ? "none" : segment.index.compression);
  }
}

double file_duration_s(const log::Statistics& s) {
  return static_cast<double>(s.message_end_time - s.message_start_time) * 1e-9;
}

ordered_json info_files_json(const std::vector<OpenLog>& logs) {
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

ordered_json info_topics_json(const LogSummary& summary) {
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

void print_info_files(const std::vector<OpenLog>& logs, bool colour, std::ostream& out) {
  Table table({"FILE", "SIZE", "MESSAGES", "FROM", "SECONDS", ""});
  for (const OpenLog& log : logs) {
    const log::Statistics& s = log.summary.statistics;
    table.row({log.path, bytes_text(log.source->size()), std::to_string(s.message_count),
               human_time(s.message_start_time), fmt::format("{:.3f}", file_duration_s(s)),
               log.summary.from_file ? "" : "not closed"});
  }
  table.print(out, colour);
  out << '\n';
}

void print_info_topics(const LogSummary& summary, bool colour, std::ostream& out) {
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
  std::unordered_map<const log::Channel*, std::uint64_t> bytes;  // of payload
  const auto add_size = [&](const Item& item) { bytes[item.channel] += item.message->data.size(); };
  if (sizes) scan_logs(logs, {}, "info", add_size);
  for (const OpenLog& log : logs) {
    out.size += log.source->size();
    out.messages += log.summary.statistics.message_count;
    add_chunks(log.summary, out);
  }
  each_metadata(logs, "", [&](const log::Metadata& record) {
    std::pair entry{record.name, record.metadata};
    if (std::ranges::find(out.metadata, entry) == out.metadata.end()) {
      out.metadata.push_back(std::move(entry));
    }
  });
  std::map<std::tuple<std::string, std::string, std::string>, std::size_t> places;
  for (const OpenChannel& c : channels_of(logs)) {
    const log::Channel& channel = *c.channel;
    const std::string node = sender_of(channel), start = start_of(channel);
    const auto [place, fresh] =
        places.try_emplace({channel.topic, node, c.type()}, out.topics.size());
    if (fresh) {
      out.topics.push_back({channel.topic,
                            c.type(),
                            node,
                            channel.message_encoding,
                            channel.metadata,
                            {},
                            0,
                            {},
                            {}});
    }
    TopicSummary& topic = out.topics[place->second];
    const std::uint64_t count = count_of(c.log->summary, channel.id);
    topic.messages += count;
    if (sizes) topic.bytes = topic.bytes.value_or(0) + bytes[c.channel];
    const std::string key = loss_key(channel);
    if (losses && losses->contains(key)) topic.losses = losses->at(key);
    NodeSummary& sender = out.nodes[node];
    sender.topics.insert(channel.topic);
    sender.messages += count;
    if (start.empty()) continue;
    topic.starts.insert(start);
    sender.starts.insert(start);
  }
  std::ranges::sort(out.topics, {},
                    [](const TopicSummary& t) { return std::tie(t.topic, t.node); });
  if (losses) {
    out.lost = 0;
    for (const auto& [key, count] : *losses) *out.lost += count.lost;
  }
  return out;
}

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
      {"files", info_files_json(logs)},
      {"topics", info_topics_json(summary)},
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
  if (logs.size() > 1) print_info_files(logs, colour, out);
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
  print_info_topics(summary, colour, out);
  return out.str();
}

void add_info(CLI::App& verb, int& exit_code) {
  CLI::App* info = verb.add_subcommand(
      "info", "Topics, counts, times, sizes and losses of logs (like ros2 bag info, mcap du)");
  struct Options {
    std::vector<std::string> files;
    bool sizes = false, json = false;
  };
  auto options = std::make_shared<Options>();
  info->add_option("FILE", options->files, "MCAP files: several are one log in parts")->required();
  info->add_flag("--sizes", options->sizes, "Bytes per topic: reads all messages");
  info->add_flag("--json", options->json, "One JSON object");
  info->footer(
      "Examples:\n  mimesis log info run.mcap --json | jq '.topics[].topic'\n"
      "  mimesis log info run_*.mcap --sizes");
  on_run(*info, exit_code, [options] {
    const auto logs = opened(options->files);
    const LogSummary summary = summarize_logs(logs, options->sizes);
    if (options->json) {
      print_json(info_json(logs, summary));
    } else {
      std::cout << info_text(logs, summary, use_colour(1));
    }
    for (const OpenLog& log : logs) {
      if (!options->sizes) report_damages(log, {});  // else told by the reading
    }
    return 0;
  });
}

}  // namespace mimesis::tool
