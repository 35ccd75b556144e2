#include "tools/mimesis/log/convert.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <span>

#include "common/json_text.h"
#include "common/runtime/raw.h"
#include "common/runtime/value_text.h"
#include "tools/mimesis/field_text.h"
#include "tools/mimesis/log/ros_messages.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/progress.h"

namespace mimesis::tool {
namespace {

// --- Lines of can-utils

constexpr std::uint32_t kErrorFlag = 0x20000000;  // as in linux/can.h
constexpr std::uint32_t kErrorMask = 0x1fffffff;
constexpr std::size_t kLongestBus = 15;  // the kernel's limit
constexpr std::size_t kClassicLength = 8, kFdLength = 64;
constexpr std::uint64_t kNanosecondsPerSecond = 1'000'000'000;

/// The line has no frame.
template <class... Args>
[[noreturn]] void no_frame(fmt::format_string<Args...> reason, Args&&... args) {
  throw Status{fmt::format(reason, std::forward<Args>(args)...)};
}

std::vector<std::string_view> line_words(std::string_view line) {
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t from = line.find_first_not_of(" \t\r");
    if (from == line.npos) return words;
    const std::size_t to = std::min(line.find_first_of(" \t\r", from), line.size());
    words.push_back(line.substr(from, to - from));
    line.remove_prefix(to);
  }
}

std::optional<std::uint32_t> hex_number(std::string_view text) {
  return runtime::to_whole<std::uint32_t>(text, 16);
}

/// "2A366C" or "2A.36.6C"
std::optional<std::string> hex_bytes(std::string_view text) {
  std::string bytes;
  for (std::size_t i = 0; i < text.size();) {
    if (text[i] == '.' && i > 0) {
      ++i;
      continue;
    }
    const auto byte = hex_number(text.substr(i, 2));
    if (!byte || i + 1 >= text.size()) return std::nullopt;
    bytes += static_cast<char>(*byte);
    i += 2;
  }
  return bytes;
}

/// "(1436509052.249713)"
std::optional<std::uint64_t> candump_time(std::string_view word) {
  if (!word.starts_with('(') || !word.ends_with(')')) return std::nullopt;
  word = word.substr(1, word.size() - 2);
  const std::size_t dot = word.find('.');
  if (dot == word.npos || word.size() - dot - 1 > 9 || dot == word.size() - 1) return std::nullopt;
  std::string fraction(word.substr(dot + 1));
  fraction.resize(9, '0');
  const auto seconds = runtime::to_whole<std::uint64_t>(word.substr(0, dot));
  const auto nanoseconds = runtime::to_whole<std::uint64_t>(fraction);
  const std::uint64_t most = std::numeric_limits<std::uint64_t>::max() / kNanosecondsPerSecond - 1;
  if (!seconds || !nanoseconds || *seconds > most) return std::nullopt;
  return *seconds * kNanosecondsPerSecond + *nanoseconds;
}

/// Three digits: 11 bits; eight: 29 bits, or an error frame.
void set_id(std::string_view text, v1::CanFrame& frame) {
  const auto id = hex_number(text);
  const std::uint32_t most = text.size() == 3 ? 0x7ff : kErrorMask | kErrorFlag;
  if (!id || (text.size() != 3 && text.size() != 8) || *id > most) {
    no_frame("'{}' is no identifier: expected 3 or 8 hexadecimal digits", text);
  }
  frame.set_error((*id & kErrorFlag) != 0);
  frame.set_extended(text.size() == 8 && !frame.error());
  frame.set_id(*id & kErrorMask);
}

/// Reads the text after "#" of a classic frame: data and "_E" for a raw length code, or "R4".
void set_classic(std::string_view text, v1::CanFrame& frame) {
  const std::size_t underscore = text.find('_');
  if (underscore != text.npos) {
    const auto code = hex_number(text.substr(underscore + 1));
    if (!code || *code < 9 || *code > 15) {
      no_frame("'{}': expected a length code of 9 to F behind the _", text);
    }
    frame.set_raw_length(*code);
    text = text.substr(0, underscore);
  }
  if (text.starts_with('R') || text.starts_with('r')) {
    const auto length = text.size() == 1 ? 0 : hex_number(text.substr(1));
    if (!length || *length > kClassicLength) {
      no_frame("'{}': expected a length of 0 to 8 behind the R", text);
    }
    frame.set_remote(true);
    return frame.set_remote_length(*length);
  }
  const auto data = hex_bytes(text);
  if (!data || data->size() > kClassicLength) {
    no_frame("'{}' is no data: expected up to 8 bytes of two digits", text);
  }
  frame.set_data(*data);
}

/// "044#2A366C2BBA"
void set_frame(std::string_view text, v1::CanFrame& frame) {
  const std::size_t sharp = text.find('#');
  if (sharp == text.npos) no_frame("'{}': expected ID#DATA", text);
  set_id(text.substr(0, sharp), frame);
  text.remove_prefix(sharp + 1);
  if (!text.starts_with('#')) return set_classic(text, frame);
  const auto flags = hex_number(text.substr(1, 1));
  const auto data = hex_bytes(text.substr(std::min<std::size_t>(2, text.size())));
  if (!flags || !data || data->size() > kFdLength) {
    no_frame("'#{}': expected ##, a digit of flags and up to 64 bytes", text);
  }
  frame.set_fd(true);
  frame.set_fd_flags(*flags);
  frame.set_data(*data);
}

/// "044   [5]  2A 36 6C 2B BA", from the word with the length on; two digits: CAN FD.
void set_shown(std::span<const std::string_view> words, v1::CanFrame& frame) {
  set_id(words[0], frame);
  const std::string_view brackets = words[1].substr(1, words[1].size() - 2);
  frame.set_fd(brackets.size() == 2);
  const auto length = runtime::to_whole<std::uint32_t>(brackets);
  if (!length || *length > (frame.fd() ? kFdLength : kClassicLength)) {
    no_frame("'{}': expected the length in brackets", words[1]);
  }
  words = words.subspan(2);
  if (!words.empty() && words[0] == "remote") {
    frame.set_remote(true);
    return frame.set_remote_length(*length);
  }
  std::string data;
  for (const std::string_view word : words.first(std::min<std::size_t>(words.size(), *length))) {
    const auto byte = word.size() == 2 ? hex_number(word) : std::nullopt;
    if (!byte) no_frame("'{}' is no byte", word);
    data += static_cast<char>(*byte);
  }
  if (data.size() != *length) {
    no_frame("expected {} bytes of data, found {}", *length, data.size());
  }
  frame.set_data(data);
}

CandumpLine parse_words(std::span<const std::string_view> words) {
  CandumpLine out;
  if (words[0].starts_with('(')) {
    out.time_ns = candump_time(words[0]);
    if (!out.time_ns) {
      no_frame("'{}' is no time: expected (SECONDS.MICROSECONDS)", words[0]);
    }
    words = words.subspan(1);
  }
  if (words.size() < 2) no_frame("expected (TIME) INTERFACE ID#DATA");
  const std::string_view bus = words[0];
  const bool is_name = bus.size() <= kLongestBus && std::ranges::all_of(bus, [](unsigned char c) {
                         return c > ' ' && c < 0x7f;
                       });
  if (!is_name) no_frame("the name of the interface is none");
  out.frame.set_bus(std::string(bus));
  words = words.subspan(1);
  const auto brackets = std::ranges::find_if(
      words, [](auto w) { return w.size() > 2 && w.starts_with('[') && w.ends_with(']'); });
  if (brackets != words.end() && brackets != words.begin()) {
    set_shown(words.subspan(static_cast<std::size_t>(brackets - words.begin()) - 1), out.frame);
  } else if (out.time_ns) {
    set_frame(words[0], out.frame);
  } else {
    no_frame("expected (TIME) INTERFACE ID#DATA, or INTERFACE ID [LENGTH] DATA");
  }
  return out;
}

// --- Conversions

constexpr std::size_t kShownDamages = 20;
constexpr std::size_t kLongestLine = 4096;

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
  while (true) {
    const auto ahead = window.view(offset, kLongestLine);
    if (!ahead) throw ConfigError(ahead.error().reason);
    if (ahead->empty()) return;
    const std::size_t end = std::min(ahead->find('\n'), ahead->size());
    const bool line_end = end < ahead->size();  // otherwise the last line, or one that is too long
    take(number, ahead->substr(0, end));
    if (line_end) ++number;
    offset += end + (line_end ? 1 : 0);
  }
}

/// Says so for the first few.
void say_damage(std::uint64_t& count, const std::string& where, const std::string& what) {
  if (count++ < kShownDamages) std::cerr << where << ": " << printable(what) << '\n';
}

void say_more(std::uint64_t count) {
  if (count > kShownDamages) std::cerr << fmt::format("and {} more\n", count - kShownDamages);
}

ConvertResult from_candump(const log::Source& source, const ConvertOptions& options) {
  ConvertResult result{.from = LogKind::candump};
  NewLog file(options.output, {options.input});
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

ConvertResult to_candump(const ConvertOptions& options) {
  ConvertResult result{.from = LogKind::mcap};
  const auto logs = open_logs({options.input});
  const auto is_can = [](const OpenChannel& c) { return c.type() == "mimesis.v1.CanFrame"; };
  if (std::ranges::none_of(channels_of(logs), is_can)) {
    throw ConfigError(options.input +
                      ": no topic of type mimesis.v1.CanFrame, which is all that candump can show");
  }
  const bool to_file = options.output.path != "-";
  if (to_file) check_output(options.output, {options.input});
  std::ofstream file;
  errno = 0;
  if (to_file) file.open(options.output.path, std::ios::binary);
  std::ostream& out = to_file ? file : std::cout;
  std::set<const log::Channel*> wanted;
  for (const OpenChannel& c : channels_of(logs)) {
    if (is_can(c)) wanted.insert(c.channel);
  }
  const log::Selection selection{[&](const log::Channel& c) { return wanted.contains(&c); }};
  const std::uint64_t damages = scan_logs(logs, selection, "convert", [&](const Item& item) {
    v1::CanFrame frame;
    if (!parse(item, frame)) {
      return say_damage(result.damages, item.channel->topic,
                        fmt::format("seq {} is no valid CanFrame", item.message->sequence));
    }
    out << candump_line(item.message->log_time, frame) << '\n';
    ++result.messages;
  });
  result.damages += damages;
  out.flush();
  if (!out)
    throw ConfigError("cannot write '" + options.output.path + "': " + std::strerror(errno));
  return result;
}

constexpr std::string_view kTransforms = "tf2_msgs/msg/TFMessage";

/// A topic as ROS allows its name: letters, digits and '_' between slashes. Transforms that are
/// told once are for all times: those of /tf count for a moment.
std::string ros_topic(const OpenChannel& of, const std::string& ros_type) {
  if (ros_type == kTransforms) {
    const auto& counts = of.log->summary.statistics.channel_message_counts;
    const auto count = counts.find(of.channel->id);
    const bool once = count != counts.end() && count->second == 1;
    return is_latched(*of.channel) && once ? "/tf_static" : "/tf";
  }
  std::string name = "/";
  for (const char c : of.channel->topic) {
    if (c == '/' && name.back() == '/') continue;
    name += std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '/' ? c : '_';
  }
  return name;
}

/// A topic of a bag.
struct BagTopic {
  std::string type;
  bool latched = false;
  std::uint64_t messages = 0;
};

/// How `ros2 bag play` offers a topic: reliable, and to late subscribers too if it is latched.
std::string offered_qos(const BagTopic& topic) {
  constexpr const char* kNever = "    sec: 9223372036\n    nsec: 854775807\n";
  return fmt::format(
      "- history: 3\n  depth: 0\n  reliability: 1\n  durability: {}\n  deadline:\n{}  lifespan:\n{}"
      "  liveliness: 1\n  liveliness_lease_duration:\n{}  avoid_ros_namespace_conventions: false",
      topic.latched ? 1 : 2, kNever, kNever, kNever);
}

/// The description that stands beside the data, as `ros2 bag record` of Humble writes it.
std::string bag_metadata(const log::Statistics& statistics, const std::string& file,
                         const std::map<std::string, BagTopic>& topics) {
  const std::uint64_t start = statistics.message_start_time,
                      duration = statistics.message_end_time - start;
  std::string text = fmt::format(
      "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n"
      "  duration:\n    nanoseconds: {}\n  starting_time:\n    nanoseconds_since_epoch: {}\n"
      "  message_count: {}\n  topics_with_message_count:\n",
      duration, start, statistics.message_count);
  for (const auto& [name, topic] : topics) {
    text += fmt::format(
        "    - topic_metadata:\n        name: {}\n        type: {}\n"
        "        serialization_format: cdr\n        offered_qos_profiles: {}\n"
        "      message_count: {}\n",
        name, topic.type, nlohmann::json(offered_qos(topic)).dump(), topic.messages);
  }
  return text + fmt::format(
                    "  compression_format: \"\"\n  compression_mode: \"\"\n"
                    "  relative_file_paths:\n    - {0}\n  files:\n    - path: {0}\n"
                    "      starting_time:\n        nanoseconds_since_epoch: {1}\n"
                    "      duration:\n        nanoseconds: {2}\n      message_count: {3}\n",
                    file, start, duration, statistics.message_count);
}

ConvertResult to_rosbag2(const ConvertOptions& options) {
  namespace fs = std::filesystem;
  const fs::path folder = options.output.path;
  std::error_code error;
  if (fs::exists(folder, error) && !options.output.force) {
    throw ConfigError(folder.string() + ": is there already; --force writes into it");
  }
  ConvertResult result{.from = LogKind::mcap};
  const auto logs = open_logs({options.input});
  std::set<std::string> left_out;
  struct Wanted {
    std::string topic;
    ToRos messages{};
  };
  std::map<const log::Channel*, Wanted> wanted;
  std::map<std::string, BagTopic> topics;
  std::map<std::string, std::string> owner_of;  // of a name in the bag
  for (const OpenChannel& c : channels_of(logs)) {
    const std::string type = ros_type(c.type());
    if (type.empty()) {
      left_out.insert(c.channel->topic);
      continue;
    }
    std::string name = ros_topic(c, type);
    const std::string owner = type == kTransforms ? type : c.channel->topic + ' ' + type;
    while (owner_of.try_emplace(name, owner).first->second != owner) {
      name += '_';  // "a-b" and "a_b", or one topic of two types
    }
    wanted[c.channel] = {name};
    topics[name].type = type;
    topics[name].latched = name != "/tf" && is_latched(*c.channel);
  }
  if (wanted.empty()) {
    throw ConfigError(options.input + ": no topic that ROS has a type for (docs/ros2.md)");
  }
  fs::create_directories(folder, error);
  OutputOptions output = options.output;
  const std::string file = fs::weakly_canonical(folder).filename().string() + "_0.mcap";
  output.path = (folder / file).string();
  NewLog bag(output, {options.input}, "ros2");
  const log::Selection selection{[&](const log::Channel& c) { return wanted.contains(&c); }};
  const std::uint64_t damages = scan_logs(logs, selection, "convert", [&](const Item& item) {
    Wanted& from = wanted[item.channel];
    const auto cdr = from.messages.convert(item.schema->name, item.message->data);
    if (!cdr) {
      return say_damage(result.damages, item.channel->topic,
                        fmt::format("seq {}: {}", item.message->sequence, cdr.error().reason));
    }
    BagTopic& to = topics[from.topic];
    const log::Schema schema{0, to.type, "ros2msg", ros_definition(to.type)};
    const std::uint16_t channel = bag.channel(
        {0, 0, from.topic, "cdr", {{"offered_qos_profiles", offered_qos(to)}}}, &schema);
    bag.write({channel, static_cast<std::uint32_t>(++to.messages), item.message->log_time,
               item.message->publish_time, *cdr});
    ++result.messages;
  });
  result.damages += damages;
  bag.finish();
  std::ofstream metadata(folder / "metadata.yaml", std::ios::binary);
  metadata << bag_metadata(bag.statistics(), file, topics);
  metadata.close();
  if (!metadata) throw ConfigError("cannot write '" + (folder / "metadata.yaml").string() + "'");
  result.left_out.assign(left_out.begin(), left_out.end());
  return result;
}

/// Exit code 0, or 1 if something could not be read.
int convert_file(const ConvertOptions& options) {
  const auto source = log::open_file(options.input);
  if (!source) throw VerbEnd{source.error().reason, 3};
  const ConvertResult r = convert_log(**source, options);
  const bool of_mcap = r.from == LogKind::mcap;
  const char* from = of_mcap ? "mcap" : "candump";
  const char* to = options.rosbag2 ? "rosbag2" : of_mcap ? "candump" : "mcap";
  if (options.json) {
    const nlohmann::ordered_json object{{"from", from},
                                        {"to", to},
                                        {"output", options.output.path},
                                        {"messages", r.messages},
                                        {"damages", r.damages},
                                        {"untimed", r.untimed},
                                        {"left_out", r.left_out}};
    (options.output.path == "-" ? std::cerr : std::cout) << json_text(object) << '\n';
  } else {
    std::cerr << fmt::format(
        "{} -> {}: {} messages{}{}\n", from, to, r.messages,
        r.damages == 0 ? "" : fmt::format(", {} damages", r.damages),
        r.untimed == 0 ? "" : fmt::format(", {} lines without a time", r.untimed));
    if (!r.left_out.empty()) {
      std::cerr << printable(
          fmt::format("left out, of types that ROS has not: {}\n", fmt::join(r.left_out, ", ")),
          "\n");
    }
  }
  return r.damages == 0 ? 0 : 1;
}

}  // namespace

tl::expected<std::optional<CandumpLine>, Status> parse_candump(std::string_view line) {
  const auto words = line_words(line);
  if (words.empty() || line.starts_with('\t')) return std::nullopt;
  try {
    return parse_words(words);
  } catch (const Status& status) {
    return tl::unexpected(status);
  }
}

std::string candump_line(std::uint64_t time_ns, const v1::CanFrame& frame) {
  std::string out = fmt::format("({:010}.{:06}) {} ", time_ns / kNanosecondsPerSecond,
                                time_ns % kNanosecondsPerSecond / 1000, frame.bus());
  if (frame.error()) {
    out += fmt::format("{:08X}", frame.id() | kErrorFlag);
  } else {
    out += frame.extended() ? fmt::format("{:08X}", frame.id()) : fmt::format("{:03X}", frame.id());
  }
  out += '#';
  if (frame.fd()) out += fmt::format("#{:X}", frame.fd_flags() & 0xf);
  if (frame.remote()) {
    out += 'R';
    if (frame.remote_length() > 0) out += fmt::format("{:X}", frame.remote_length());
  } else {
    for (const char c : frame.data()) out += fmt::format("{:02X}", static_cast<unsigned char>(c));
  }
  if (frame.raw_length() > 0) out += fmt::format("_{:X}", frame.raw_length());
  return out;
}

LogKind detect_kind(const log::Source& source, const std::string& path) {
  struct Foreign {
    std::string_view start, says;
  };
  static constexpr Foreign kForeign[] = {
      {"SQLite format 3", "a rosbag2 of the sqlite3 kind: `ros2 bag convert` makes MCAP of it"},
      {"#ROSBAG V", "a bag of ROS 1: `mcap convert` makes MCAP of it"},
      {"ULog", "a ULog of PX4, which is not supported"},
      {"\xED\xA1\xDA\x01", "a log of LCM, which is not supported"},
      {"\x1f\x8b", "compressed by gzip: unpack it first"},
      {"(\xB5/\xFD", "compressed by zstd: unpack it first"}};
  log::Window window(source);
  const std::string_view start = window.view(0, kLongestLine).value_or(std::string_view{});
  if (start.starts_with(log::kMagic)) return LogKind::mcap;
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
  throw ConfigError(path + ": expected a log of candump or MCAP; --candump takes it for the first");
}

ConvertResult convert_log(const log::Source& source, const ConvertOptions& options) {
  const LogKind kind = options.candump ? LogKind::candump : detect_kind(source, options.input);
  if (kind == LogKind::mcap && !options.rosbag2) return to_candump(options);
  if (kind != LogKind::mcap && options.rosbag2) {
    throw ConfigError(options.input + ": --rosbag2 needs a log in MCAP");
  }
  if (options.output.path == "-") throw ConfigError("-: MCAP needs a file");
  try {
    return kind == LogKind::mcap ? to_rosbag2(options) : from_candump(source, options);
  } catch (const NotWritten& failure) {
    throw ConfigError(failure.reason);
  }
}

void add_convert(CLI::App& verb, int& exit_code) {
  CLI::App* sub = verb.add_subcommand(
      "convert", "Logs of candump to MCAP, MCAP to candump or to a bag of ROS 2");
  auto o = std::make_shared<ConvertOptions>();
  sub->add_option("IN", o->input,
                  "candump -l (or what candump shows), or MCAP; told by its content")
      ->required();
  sub->add_option("OUT", o->output.path,
                  "MCAP file; of MCAP: log for canplayer, - for standard output, or folder")
      ->required();
  sub->add_flag("--candump", o->candump, "IN is of candump, whatever its content looks like");
  sub->add_flag("--rosbag2", o->rosbag2,
                "OUT is a folder for ros2 bag: images, joint states, transforms, logs, scenes")
      ->excludes("--candump");
  sub->add_flag("--force", o->output.force, "Replace OUT if it exists");
  sub->add_option("--compression", o->compression, "Of MCAP: none, lz4 or zstd")
      ->check(CLI::IsMember({"none", "lz4", "zstd"}))
      ->capture_default_str();
  sub->add_flag("--json", o->json, "Print one JSON object at the end");
  sub->footer(
      "CAN frames become mimesis.v1.CanFrame on can/INTERFACE. What is damaged is left out, said\n"
      "and counted: exit code 1. rosbag2 with sqlite3 (ros2 bag convert) and ROS 1 bags (mcap "
      "convert) have converters of their own; a\n"
      "rosbag2 in MCAP needs none.\n"
      "Examples:\n  mimesis log convert candump-2026-11-21.log can.mcap\n"
      "  mimesis log convert run.mcap run_bag --rosbag2; ros2 bag play run_bag");
  on_run(*sub, exit_code, [o] {
    o->output.compression = *log::parse_compression(o->compression);
    return convert_file(*o);
  });
}

}  // namespace mimesis::tool
