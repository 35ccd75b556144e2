#include "tools/mimesis/log/convert.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <set>

#include "common/error.h"
#include "common/runtime/raw.h"
#include "tools/mimesis/log/convert_lcm.h"
#include "tools/mimesis/log/new_log.h"
#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/progress.h"

namespace mimesis::tool {
namespace {

constexpr std::size_t kShownDamages = 20;
constexpr std::size_t kLongestLine = 4096;
constexpr std::size_t kFingerprint = 8;  // bytes at the start of LCM data

/// Failure to write is final, and the user's to mend.
template <class T>
T required(tl::expected<T, Status> result) {
  if (!result) throw ConfigError(result.error().reason);
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

OutputOptions output_of(const ConvertOptions& options) {
  return {.path = options.output, .force = options.force, .compression = options.compression};
}

/// A channel of the log that is written.
struct OutChannel {
  std::uint16_t id = 0;
  std::uint32_t sequence = 0;
};

/// Calls `take(number, line)` for each line of a text.
template <class Take>
void each_line(const log::Source& source, const Take& take) {
  log::Window window(source);
  std::uint64_t offset = 0, number = 1;
  for (std::string_view ahead; !(ahead = required(window.view(offset, kLongestLine))).empty();) {
    const std::size_t end = std::min(ahead.find('\n'), ahead.size());
    take(number, ahead.substr(0, end));
    if (end < ahead.size()) ++number;  // else the last line, or one that is too long
    offset += end + (end < ahead.size() ? 1 : 0);
  }
}

/// Says so for the first few.
void say_damage(std::uint64_t& count, const std::string& where, const std::string& what) {
  if (count++ < kShownDamages) std::cerr << where << ": " << what << '\n';
}

void say_more(std::uint64_t count) {
  if (count > kShownDamages) std::cerr << fmt::format("and {} more\n", count - kShownDamages);
}

ConvertResult from_candump(const log::Source& source, const ConvertOptions& options) {
  ConvertResult result{.from = LogKind::candump};
  NewLog file(output_of(options), {options.input});
  const log::Schema schema{.name = "mimesis.v1.CanFrame",
                           .encoding = "protobuf",
                           .data = runtime::descriptor_set(*v1::CanFrame::descriptor())};
  std::map<std::string, OutChannel> buses;
  std::uint64_t time_ns = 0, bytes = 0;
  Progress progress("convert", source.size());
  each_line(source, [&](std::uint64_t number, std::string_view text) {
    progress.at(bytes += text.size() + 1);
    auto line = parse_candump(text);
    if (!line) {
      return say_damage(result.damages, fmt::format("{}:{}", options.input, number),
                        line.error().reason);
    }
    if (!*line) return;
    v1::CanFrame& frame = (*line)->frame;
    if (!(*line)->time_ns) ++result.untimed;
    time_ns = (*line)->time_ns.value_or(time_ns);
    OutChannel& bus = buses[frame.bus()];
    if (bus.id == 0) {
      bus.id = file.channel({.topic = "can/" + frame.bus(),
                             .message_encoding = "protobuf",
                             .metadata = {{"source", "candump"}}},
                            &schema);
    }
    frame.mutable_header()->set_stamp_ns(time_ns);
    frame.mutable_header()->set_seq(++bus.sequence);
    const std::string payload = frame.SerializeAsString();
    file.write({bus.id, bus.sequence, time_ns, time_ns, payload});
    ++result.messages;
  });
  say_more(result.damages);
  file.finish();
  return result;
}

ConvertResult from_lcm(const log::Source& source, const ConvertOptions& options) {
  ConvertResult result{.from = LogKind::lcm};
  NewLog file(output_of(options), {options.input});
  std::map<std::pair<std::string, std::string>, OutChannel> channels;  // by name and fingerprint
  LcmReader reader(source);
  Progress progress("convert", source.size());
  while (const auto event = reader.next()) {
    progress.at(reader.position());
    const std::string name(event->channel);
    std::string fingerprint;
    if (event->data.size() >= kFingerprint) {
      for (const char c : event->data.substr(0, kFingerprint)) {
        fingerprint += fmt::format("{:02x}", static_cast<unsigned char>(c));
      }
    }
    OutChannel& channel = channels[{name, fingerprint}];
    if (channel.id == 0) {
      channel.id = file.channel({.topic = name,
                                 .message_encoding = "lcm",
                                 .metadata = {{"lcm_fingerprint", fingerprint}}},
                                nullptr);
    }
    file.write({channel.id, ++channel.sequence, event->time_ns, event->time_ns, event->data});
    ++result.messages;
  }
  for (const log::Damage& d : reader.damages()) {
    say_damage(result.damages, fmt::format("{}: byte {}", options.input, d.offset), d.what);
  }
  say_more(result.damages);
  result.lost = reader.lost();
  file.finish();
  return result;
}

ConvertResult to_candump(const ConvertOptions& options) {
  ConvertResult result{.from = LogKind::mcap};
  const auto logs = opened({options.input});
  const auto is_can = [](const OpenChannel& c) { return c.type() == "mimesis.v1.CanFrame"; };
  if (std::ranges::none_of(channels_of(logs), is_can)) {
    throw ConfigError(options.input +
                      ": no topic of type mimesis.v1.CanFrame, which is all that candump can show");
  }
  const bool to_file = options.output != "-";
  if (to_file) check_output(output_of(options), {options.input});
  std::ofstream file;
  errno = 0;
  if (to_file) file.open(options.output, std::ios::binary);
  std::ostream& out = to_file ? file : std::cout;
  std::set<const log::Channel*> wanted;
  for (const OpenChannel& c : channels_of(logs)) {
    if (is_can(c)) wanted.insert(c.channel);
  }
  const log::Selection selection{[&](const log::Channel& c) { return wanted.contains(&c); }};
  const std::uint64_t damages = scan_logs(logs, selection, "convert", [&](const Item& item) {
    v1::CanFrame frame;
    const std::string_view data = item.message->data;
    if (!frame.ParseFromArray(data.data(), static_cast<int>(data.size()))) {
      return say_damage(result.damages, item.channel->topic,
                        fmt::format("seq {} is no valid CanFrame", item.message->sequence));
    }
    out << candump_line(item.message->log_time, frame) << '\n';
    ++result.messages;
  });
  result.damages += damages;
  out.flush();
  if (!out) throw ConfigError("cannot write '" + options.output + "': " + std::strerror(errno));
  return result;
}

/// Exit code 0, or 1 if something could not be read.
int convert_file(const ConvertOptions& options, bool json) {
  const auto source = log::open_file(options.input);
  if (!source) throw VerbEnd{source.error().reason, 3};
  const ConvertResult r = convert_log(**source, options);
  static constexpr const char* kNames[] = {"mcap", "candump", "lcm"};
  const char* from = kNames[static_cast<int>(r.from)];
  const char* to = r.from == LogKind::mcap ? "candump" : "mcap";
  if (json) {
    const nlohmann::ordered_json object{{"from", from},
                                        {"to", to},
                                        {"output", options.output},
                                        {"messages", r.messages},
                                        {"damages", r.damages},
                                        {"lost", r.lost},
                                        {"untimed", r.untimed}};
    (options.output == "-" ? std::cerr : std::cout) << object.dump() << '\n';
  } else {
    std::cerr << fmt::format(
        "{} -> {}: {} messages{}{}{}\n", from, to, r.messages,
        r.damages == 0 ? "" : fmt::format(", {} damages", r.damages),
        r.lost == 0 ? "" : fmt::format(", {} lost by the logger", r.lost),
        r.untimed == 0 ? "" : fmt::format(", {} lines without a time", r.untimed));
  }
  return r.damages == 0 ? 0 : 1;
}

}  // namespace

LogKind detect_kind(const log::Source& source, const std::string& path) {
  struct Foreign {
    std::string_view start, says;
  };
  static constexpr Foreign kForeign[] = {
      {"SQLite format 3", "a rosbag2 of the sqlite3 kind: `ros2 bag convert` makes MCAP of it"},
      {"#ROSBAG V", "a bag of ROS 1: `mcap convert` makes MCAP of it"},
      {"ULog", "a ULog of PX4, which is not supported"},
      {"\x1f\x8b", "compressed by gzip: unpack it first"},
      {"(\xB5/\xFD", "compressed by zstd: unpack it first"}};
  log::Window window(source);
  const std::string_view start = window.view(0, kLongestLine).value_or(std::string_view{});
  if (start.starts_with(log::kMagic)) return LogKind::mcap;
  if (start.starts_with("\xED\xA1\xDA\x01")) return LogKind::lcm;
  for (const Foreign& foreign : kForeign) {
    if (start.starts_with(foreign.start)) {
      throw ConfigError(path + ": " + std::string(foreign.says));
    }
  }
  for (std::string_view rest = start; !rest.empty();) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const auto line = parse_candump(rest.substr(0, end));
    if (line && *line) return LogKind::candump;
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  throw ConfigError(path + ": expected a log of candump, an LCM log or MCAP; --from says which");
}

ConvertResult convert_log(const log::Source& source, const ConvertOptions& options) {
  const LogKind kind = options.from == "candump" ? LogKind::candump
                       : options.from == "lcm"   ? LogKind::lcm
                                                 : detect_kind(source, options.input);
  if (kind == LogKind::mcap) return to_candump(options);
  if (options.output == "-") throw ConfigError("-: MCAP needs a file");
  try {
    return kind == LogKind::lcm ? from_lcm(source, options) : from_candump(source, options);
  } catch (const NotWritten& failure) {
    throw ConfigError(failure.reason);
  }
}

void add_convert(CLI::App& verb, int& exit_code) {
  CLI::App* sub =
      verb.add_subcommand("convert", "Logs of candump and LCM to MCAP, and MCAP to candump");
  struct Options {
    ConvertOptions convert;
    std::string compression = "zstd";
    bool json = false;
  };
  auto o = std::make_shared<Options>();
  sub->add_option("IN", o->convert.input,
                  "candump -l (or what candump shows), an LCM log, or MCAP; told by its content")
      ->required();
  sub->add_option("OUT", o->convert.output,
                  "MCAP file; of MCAP: log for canplayer, - for standard output")
      ->required();
  sub->add_option("--from", o->convert.from, "candump or lcm, whatever the content looks like")
      ->check(CLI::IsMember({"candump", "lcm"}));
  sub->add_flag("--force", o->convert.force, "Replace OUT if it exists");
  sub->add_option("--compression", o->compression, "Of MCAP: none, lz4 or zstd")
      ->check(CLI::IsMember({"none", "lz4", "zstd"}))
      ->capture_default_str();
  sub->add_flag("--json", o->json, "Print one JSON object at the end");
  sub->footer(
      "CAN frames become mimesis.v1.CanFrame on can/INTERFACE. LCM channels keep name and "
      "payload,\n"
      "encoding lcm. What is damaged is left out, said and counted: exit code 1. rosbag2 with\n"
      "sqlite3 (ros2 bag convert) and ROS 1 bags (mcap convert) have converters of their own; a\n"
      "rosbag2 in MCAP needs none.\n"
      "Examples: mimesis log convert candump-2026-11-21.log can.mcap\n"
      "          mimesis log convert lcmlog-2026-11-21.00 lcm.mcap");
  on_run(*sub, exit_code, [o] {
    o->convert.compression = *log::parse_compression(o->compression);
    return convert_file(o->convert, o->json);
  });
}

}  // namespace mimesis::tool
