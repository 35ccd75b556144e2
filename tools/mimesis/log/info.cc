#include "tools/mimesis/log/info.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <tuple>
#include <unordered_map>

#include "common/runtime/own_topics.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/log/elided_payload.h"
#include "tools/mimesis/log/provenance.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using nlohmann::ordered_json;

/// One topic of one node, in all files together.
struct TopicSummary {
  std::string encoding;
  std::map<std::string, std::string> metadata;  ///< metadata of its first channel
  std::set<std::string> starts;                 ///< starts of the node, by start_id
  std::uint64_t messages = 0, bytes = 0;        ///< bytes of payload
  std::optional<std::uint64_t> lost = {};       ///< losses that the recorder counted
};

struct NodeSummary {
  std::set<std::string> topics, starts;
  std::uint64_t messages = 0;
};

double seconds_between(std::uint64_t start_ns, std::uint64_t end_ns) {
  return static_cast<double>(end_ns - start_ns) * 1e-9;
}

/// Members "lost", "topics" and "nodes". `bytes`: of payload by channel, if they are known.
void add_topics(const std::vector<OpenLog>& logs, double duration_s,
                const std::optional<std::unordered_map<const log::Channel*, std::uint64_t>>& bytes,
                ordered_json& out) {
  std::map<std::tuple<std::string, std::string, std::string>, TopicSummary> topics;
  std::map<std::string, NodeSummary> nodes;
  const auto losses = read_losses(logs);
  for (const OpenChannel& c : channels_of(logs)) {
    const log::Channel& channel = *c.channel;
    const std::string node = sender_of(channel), start = start_of(channel);
    TopicSummary& topic =
        topics
            .try_emplace({channel.topic, node, c.type()},
                         TopicSummary{channel.message_encoding, channel.metadata, {}})
            .first->second;
    const auto& counts = c.log->summary.statistics.channel_message_counts;
    const auto count = counts.find(channel.id);
    const std::uint64_t messages = count == counts.end() ? 0 : count->second;
    topic.messages += messages;
    if (bytes && bytes->contains(&channel)) topic.bytes += bytes->at(&channel);
    const std::string key = loss_key(channel);
    if (losses && losses->contains(key)) topic.lost = losses->at(key).lost;
    NodeSummary& sender = nodes[node];
    sender.topics.insert(channel.topic);
    sender.messages += messages;
    if (start.empty()) continue;
    topic.starts.insert(start);
    sender.starts.insert(start);
  }
  if (losses) {
    std::uint64_t lost = 0;
    for (const auto& [key, count] : *losses) lost += count.lost;
    out["lost"] = lost;
  }
  for (const auto& [key, t] : topics) {
    const auto& [topic, node, type] = key;
    out["topics"].push_back(
        {{"topic", topic},
         {"type", type},
         {"node", node},
         {"encoding", t.encoding},
         {"messages", t.messages},
         {"rate_hz", duration_s > 0.0 ? static_cast<double>(t.messages) / duration_s : 0.0},
         {"starts", t.starts.size()},
         {"metadata", t.metadata},
         {"lost", json_or_null(t.lost)},
         {"bytes", bytes ? ordered_json(t.bytes) : ordered_json(nullptr)}});
  }
  for (const auto& [name, node] : nodes) {
    if (name.empty()) continue;
    out["nodes"].push_back({{"node", name},
                            {"topics", node.topics},
                            {"messages", node.messages},
                            {"starts", node.starts}});
  }
}

/// What `mimesis log replay` would start: for each node that left a NODE/start its program.
ordered_json replayed_programs(const std::vector<OpenLog>& logs) {
  ordered_json found = ordered_json::array();
  auto reader = merged(logs, {.channel = [](const log::Channel& channel) {
                         return runtime::is_own_topic(channel.topic, runtime::kStartPort);
                       }});
  v1::NodeStart start;
  while (const Item* item = reader.next()) {
    if (item->schema == nullptr || item->schema->name != start.GetTypeName() ||
        !parse(*item, start))
      continue;
    ordered_json one{{"node", start.node()},
                     {"program", start.executable()},
                     {"refused", !is_program_name(start.executable())}};
    if (std::ranges::find(found, one) == found.end()) found.push_back(std::move(one));
  }
  return found;
}

void print_info_files(const std::vector<OpenLog>& logs, bool colour, std::ostream& out) {
  TextTable table({"FILE", "SIZE", "MESSAGES", "FROM", "SECONDS", ""});
  for (const OpenLog& log : logs) {
    const log::Statistics& s = log.summary.statistics;
    table.row({log.path, bytes_text(log.source->size()), std::to_string(s.message_count),
               human_time(s.message_start_time),
               fmt::format("{:.3f}", seconds_between(s.message_start_time, s.message_end_time)),
               log.summary.from_file ? "" : "not closed"});
  }
  table.print(out, colour);
  out << '\n';
}

void print_info_topics(const ordered_json& topics, bool colour, std::ostream& out) {
  const bool sizes = !topics.empty() && !topics[0]["bytes"].is_null();
  std::vector<std::string> heading{"TOPIC", "TYPE", "NODE", "MESSAGES", "LOST", "HZ"};
  if (sizes) heading.insert(heading.end(), {"BYTES", "SHARE"});
  double total = 0.0;
  for (const ordered_json& t : topics) total += sizes ? t["bytes"].get<double>() : 0.0;
  TextTable table(std::move(heading));
  for (const ordered_json& t : topics) {
    // Messages that are computed again (elided_payload.h).
    const auto& metadata = t["metadata"];
    const bool elided = metadata.is_object() &&
                        (metadata.contains(kElidedKey) || metadata.contains(kFormerElidedKey));
    std::vector<std::string> cells{t["topic"],
                                   t["type"].get<std::string>() + (elided ? " (elided)" : ""),
                                   t["node"],
                                   t["messages"].dump(),
                                   t["lost"].is_null() ? "?" : t["lost"].dump(),
                                   fmt::format("{:.1f}", t["rate_hz"].get<double>())};
    if (sizes) {
      cells.push_back(bytes_text(t["bytes"]));
      cells.push_back(
          fmt::format("{:.1f} %", total > 0.0 ? 100.0 * t["bytes"].get<double>() / total : 0.0));
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

std::string nodes_text(const ordered_json& nodes) {
  std::string text;
  for (const ordered_json& node : nodes) {
    text += (text.empty() ? "" : ", ") + node["node"].get<std::string>();
    if (const auto starts = node["starts"].size(); starts > 1) {
      text += fmt::format(" (started {} times)", starts);
    }
  }
  return text;
}

}  // namespace

ordered_json info_json(const std::vector<OpenLog>& logs, bool sizes) {
  const OpenLog& first = logs.front();
  const Span span = span_of(logs);
  const double duration_s = seconds_between(span.start_ns, span.end_ns);
  std::optional<std::unordered_map<const log::Channel*, std::uint64_t>> bytes;
  if (sizes) {
    bytes.emplace();
    scan_logs(
        logs, {}, "info",
        [&](const Item& item) { (*bytes)[item.channel] += item.message->data.size(); },
        /*silent=*/true);  // the verb reports damages
  }
  std::uint64_t size = 0, messages = 0, chunks = 0, compressed = 0, uncompressed = 0;
  std::set<std::string> compressions;
  ordered_json files = ordered_json::array(), metadata = files, attachments = files,
               damages = files;
  for (const OpenLog& log : logs) {
    const log::Statistics& s = log.summary.statistics;
    size += log.source->size();
    messages += s.message_count;
    for (const log::Segment& segment : log.summary.segments) {
      chunks += segment.bare ? 0 : 1;
      compressed += segment.index.compressed_size;
      uncompressed += segment.index.uncompressed_size;
      const std::string& compression = segment.index.compression;
      compressions.insert(compression.empty() ? "none" : compression);
    }
    files.push_back({{"file", log.path},
                     {"size", log.source->size()},
                     {"library", log.summary.header.library},
                     {"closed", log.summary.from_file},
                     {"messages", s.message_count},
                     {"start_ns", s.message_start_time},
                     {"end_ns", s.message_end_time}});
    for (const auto& a : log.summary.attachments) {
      attachments.push_back({{"file", log.path},
                             {"name", a.name},
                             {"media_type", a.media_type},
                             {"size", a.data_size}});
    }
    for (const auto& d : log.summary.damages) {
      damages.push_back({{"file", log.path}, {"offset", d.offset}, {"what", d.what}});
    }
  }
  each_metadata(logs, "", [&](const log::Metadata& record) {  // each once
    ordered_json entry{{"name", record.name}, {"values", record.metadata}};
    if (std::ranges::find(metadata, entry) == metadata.end()) metadata.push_back(std::move(entry));
  });
  ordered_json out{
      {"file", first.path},
      {"size", size},
      {"library", first.summary.header.library},
      {"closed", std::ranges::all_of(logs, [](const OpenLog& l) { return l.summary.from_file; })},
      {"messages", messages},
      {"start_ns", span.start_ns},
      {"end_ns", span.end_ns},
      {"duration_s", duration_s},
      {"chunks", chunks},
      {"compression", compressions},
      {"compressed_size", compressed},
      {"uncompressed_size", uncompressed},
      {"files", files},
      {"topics", ordered_json::array()},
      {"nodes", ordered_json::array()},
      {"replay", replayed_programs(logs)},
      {"attachments", attachments},
      {"metadata", metadata},
      {"damages", damages},
      {"lost", nullptr}};
  add_topics(logs, duration_s, bytes, out);
  return out;
}

std::string info_text(const std::vector<OpenLog>& logs, const ordered_json& info, bool colour) {
  std::ostringstream out;
  const auto line = [&](std::string_view label, const std::string& value) {
    out << fmt::format("{:<12} {}\n", label, printable(value));
  };
  if (logs.size() > 1) {
    print_info_files(logs, colour, out);
    line("files", fmt::format("{} ({})", logs.size(), bytes_text(info["size"])));
  } else {
    line("file", fmt::format("{} ({}{})", logs.front().path, bytes_text(info["size"]),
                             info["closed"] ? "" : ", without a summary: read as a whole"));
  }
  line("library", info["library"]);
  line("messages", fmt::format("{} on {} topics", info["messages"].dump(), info["topics"].size()));
  line("lost", info["lost"].is_null() ? "not counted" : info["lost"].dump());
  line("time", fmt::format("{} to {} ({:.3f} s)", human_time(info["start_ns"]),
                           human_time(info["end_ns"]), info["duration_s"].get<double>()));
  const std::uint64_t compressed = info["compressed_size"],
                      uncompressed = info["uncompressed_size"];
  line("chunks", fmt::format("{}, {}, {} of {} ({:.2f} : 1)", info["chunks"].dump(),
                             fmt::join(info["compression"].get<std::vector<std::string>>(), ", "),
                             bytes_text(compressed), bytes_text(uncompressed),
                             compressed == 0 ? 1.0
                                             : static_cast<double>(uncompressed) /
                                                   static_cast<double>(compressed)));
  if (const std::string nodes = nodes_text(info["nodes"]); !nodes.empty()) line("nodes", nodes);
  std::string programs;
  for (const ordered_json& one : info["replay"]) {
    const std::string node = one["node"], program = one["program"];
    if (!programs.empty()) programs += ", ";
    programs += program == "mimesis_" + node ? program : node + ": " + program;
    if (one["refused"]) programs += " (refused)";
  }
  if (!programs.empty()) line("replay runs", programs);
  for (const ordered_json& a : info["attachments"]) {
    line("attachment", fmt::format("{} ({}, {})", a["name"].get<std::string>(),
                                   a["media_type"].get<std::string>(), bytes_text(a["size"])));
  }
  for (const ordered_json& record : info["metadata"]) {
    const std::string name = record["name"];
    if (name.starts_with(kCountsName)) continue;  // column LOST
    line("metadata", name);
    for (const auto& [key, value] : record["values"].items())
      line("", key + ": " + in_one_line(value));
  }
  out << '\n';
  print_info_topics(info["topics"], colour, out);
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
      "Reads the data of a log once for its sum. Exit code 1 if it is damaged: 'check' says "
      "where.\n"
      "Examples:\n  mimesis log info run.mcap --json | jq '.topics[].topic'\n"
      "  mimesis log info run_*.mcap --sizes");
  on_run(*info, exit_code, [options] {
    auto logs = open_logs(options->files);
    for (OpenLog& log : logs) {
      const auto damage =
          log.summary.from_file ? log::check_data_sum(*log.source, log.summary) : std::nullopt;
      if (damage) log.summary.damages.push_back(*damage);
      log.summary.damage_count += damage ? 1 : 0;
    }
    const ordered_json found = info_json(logs, options->sizes);
    if (options->json) {
      print_json(found);
    } else {
      std::cout << info_text(logs, found, use_colour(1));
    }
    std::uint64_t damages = 0;
    for (const OpenLog& log : logs) {
      damages += report_losses(log, log.summary.damages, log.summary.damage_count);
    }
    return damages == 0 ? 0 : 1;
  });
}

}  // namespace mimesis::tool
