#include "tools/mimesis/log/info.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>

#include "common/log/summary.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using nlohmann::ordered_json;

constexpr double kSecond = 1e9;                                    // of log times, in ns
constexpr std::uint64_t kYear2000 = 946684800ull * 1'000'000'000;  // later ones are wall time

struct Sizes {
  std::uint64_t chunks = 0, compressed = 0, uncompressed = 0;
  std::set<std::string> compressions;
};

Sizes sizes_of(const log::Summary& summary) {
  Sizes sizes;
  for (const log::Segment& segment : summary.segments) {
    sizes.chunks += segment.bare ? 0 : 1;
    sizes.compressed += segment.index.compressed_size;
    sizes.uncompressed += segment.index.uncompressed_size;
    sizes.compressions.insert(segment.index.compression.empty() ? "none"
                                                                : segment.index.compression);
  }
  return sizes;
}

std::string sender_of(const log::Channel& channel) {
  const auto it = channel.metadata.find("node");
  return it == channel.metadata.end() ? "" : it->second;
}

std::uint64_t count_of(const log::Summary& summary, std::uint16_t id) {
  const auto it = summary.statistics.channel_message_counts.find(id);
  return it == summary.statistics.channel_message_counts.end() ? 0 : it->second;
}

std::string type_of(const log::Summary& summary, const log::Channel& channel) {
  const auto it = summary.schemas.find(channel.schema_id);
  return it == summary.schemas.end() ? "" : it->second.name;
}

double rate_of(std::uint64_t count, double duration_s) {
  return duration_s > 0.0 ? static_cast<double>(count) / duration_s : 0.0;
}

std::string human_time(std::uint64_t ns) {
  const double seconds = static_cast<double>(ns) / kSecond;
  if (ns < kYear2000) return fmt::format("{:.3f} s", seconds);
  const auto whole = static_cast<std::time_t>(ns / 1'000'000'000);
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03} UTC", fmt::gmtime(whole), ns / 1'000'000 % 1000);
}

std::string human_bytes(std::uint64_t bytes) {
  static constexpr const char* kUnits[] = {"B", "kB", "MB", "GB", "TB"};
  auto value = static_cast<double>(bytes);
  std::size_t unit = 0;
  for (; value >= 1000.0 && unit + 1 < std::size(kUnits); ++unit) value /= 1000.0;
  return unit == 0 ? fmt::format("{} B", bytes) : fmt::format("{:.1f} {}", value, kUnits[unit]);
}

ordered_json to_json(const std::string& path, std::uint64_t file_size, const log::Source& source,
                     const log::Summary& summary) {
  const log::Statistics& s = summary.statistics;
  const Sizes sizes = sizes_of(summary);
  const double duration = static_cast<double>(s.message_end_time - s.message_start_time) / kSecond;
  ordered_json out{{"file", path},
                   {"size", file_size},
                   {"library", summary.header.library},
                   {"closed", summary.from_file},
                   {"messages", s.message_count},
                   {"start_ns", s.message_start_time},
                   {"end_ns", s.message_end_time},
                   {"duration_s", duration},
                   {"chunks", sizes.chunks},
                   {"compression", sizes.compressions},
                   {"compressed_size", sizes.compressed},
                   {"uncompressed_size", sizes.uncompressed},
                   {"topics", ordered_json::array()},
                   {"attachments", ordered_json::array()},
                   {"metadata", ordered_json::array()},
                   {"damages", ordered_json::array()}};
  for (const auto& [id, channel] : summary.channels) {
    const std::uint64_t count = count_of(summary, id);
    out["topics"].push_back({{"topic", channel.topic},
                             {"type", type_of(summary, channel)},
                             {"node", sender_of(channel)},
                             {"messages", count},
                             {"rate_hz", rate_of(count, duration)},
                             {"metadata", channel.metadata}});
  }
  for (const auto& a : summary.attachments) {
    out["attachments"].push_back(
        {{"name", a.name}, {"media_type", a.media_type}, {"size", a.data_size}});
  }
  for (const auto& index : summary.metadata) {
    const auto metadata = log::read_metadata(source, index);
    if (metadata)
      out["metadata"].push_back({{"name", metadata->name}, {"values", metadata->metadata}});
  }
  for (const auto& d : summary.damages) {
    out["damages"].push_back({{"offset", d.offset}, {"what", d.what}});
  }
  return out;
}

void print_text(const std::string& path, std::uint64_t file_size, const log::Source& source,
                const log::Summary& summary) {
  const log::Statistics& s = summary.statistics;
  const Sizes sizes = sizes_of(summary);
  const double duration = static_cast<double>(s.message_end_time - s.message_start_time) / kSecond;
  const auto line = [](std::string_view label, const std::string& value) {
    std::cout << fmt::format("{:<12} {}\n", label, value);
  };
  line("file", fmt::format("{} ({}{})", path, human_bytes(file_size),
                           summary.from_file ? "" : ", without a summary: read as a whole"));
  line("library", summary.header.library);
  line("messages", fmt::format("{} on {} topics", s.message_count, summary.channels.size()));
  line("time", fmt::format("{} to {} ({:.3f} s)", human_time(s.message_start_time),
                           human_time(s.message_end_time), duration));
  line("chunks", fmt::format("{}, {}, {} of {} ({:.2f} : 1)", sizes.chunks,
                             fmt::join(sizes.compressions, ", "), human_bytes(sizes.compressed),
                             human_bytes(sizes.uncompressed),
                             sizes.compressed == 0 ? 1.0
                                                   : static_cast<double>(sizes.uncompressed) /
                                                         static_cast<double>(sizes.compressed)));
  for (const auto& a : summary.attachments) {
    line("attachment", fmt::format("{} ({}, {})", a.name, a.media_type, human_bytes(a.data_size)));
  }
  for (const auto& index : summary.metadata) {
    const auto metadata = log::read_metadata(source, index);
    if (!metadata) {
      line("metadata", metadata.error().reason);
      continue;
    }
    line("metadata", metadata->name);
    for (const auto& [key, value] : metadata->metadata) line("", key + ": " + value);
  }
  std::cout << '\n';
  Table table({"TOPIC", "TYPE", "NODE", "MESSAGES", "HZ"});
  for (const auto& [id, channel] : summary.channels) {
    const std::uint64_t count = count_of(summary, id);
    table.row({channel.topic, type_of(summary, channel), sender_of(channel), std::to_string(count),
               fmt::format("{:.1f}", rate_of(count, duration))});
  }
  table.print(std::cout, use_colour(1));
}

}  // namespace

int log_info(const std::string& path, bool json) {
  const auto source = log::open_file(path);
  if (!source) {
    std::cerr << source.error().reason << '\n';
    return 3;
  }
  auto summary = log::summarize(**source);
  if (summary && !summary->counted) summary = log::scan(**source);
  if (!summary) {
    std::cerr << path << ": " << summary.error().reason << '\n';
    return 1;
  }
  if (json) {
    std::cout << to_json(path, (*source)->size(), **source, *summary).dump() << '\n';
  } else {
    print_text(path, (*source)->size(), **source, *summary);
  }
  for (const auto& d : summary->damages)
    std::cerr << path << ": byte " << d.offset << ": " << d.what << '\n';
  if (summary->damage_count > summary->damages.size()) {
    std::cerr << path << ": and " << summary->damage_count - summary->damages.size() << " more\n";
  }
  return 0;
}

}  // namespace mimesis::tool
