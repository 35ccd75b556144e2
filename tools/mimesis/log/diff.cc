#include "tools/mimesis/log/diff.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <deque>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/error.h"
#include "common/runtime/own_topics.h"
#include "common/runtime/value_text.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/log/field_columns.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

constexpr std::string_view kEveryTopic = "*.";

/// "blobs[2].u_px[*]" -> "blobs.2.u_px", as DiffRules names it.
std::string rule_path(const std::string& path) {
  std::string out;
  for (const char c : path) {
    if (c == '[') out += '.';
    if (c != '[' && c != ']') out += c;
  }
  for (std::size_t at; (at = out.find(".*")) != std::string::npos;) out.erase(at, 2);
  return out;
}

/// A message, or a copy of one that waits for its counterpart.
struct HeldMessage {
  std::uint64_t sequence;
  std::uint64_t log_time, publish_time;
  std::string bytes;
  const log::Schema* schema;
};

struct DiffStream {
  StreamDiff diff;
  const DiffRules* rules = nullptr;
  bool in_a = false, in_b = false;
  std::uint64_t read[2] = {0, 0};
  std::deque<HeldMessage> waiting[2];  ///< messages of the log that is ahead
};

/// Topic, node, and how often that node had been started before: the ids of its starts differ
/// between runs.
using StreamKey = std::tuple<std::string, std::string, std::size_t>;

struct DiffSide {
  const OpenLog* log = nullptr;
  std::unique_ptr<log::IndexedReader> reader;
  const log::Message* next = nullptr;
  std::map<std::uint16_t, std::pair<DiffStream*, const log::Schema*>> streams;  ///< by channel

  /// From the log's own start, so that runs of two days go side by side.
  std::uint64_t time() const { return next->log_time - log->summary.statistics.message_start_time; }
};

class LogComparison {
 public:
  LogComparison(const OpenLog& a, const OpenLog& b, const DiffOptions& options)
      : options_(options), rules_(diff_rules(options, a, b)) {
    open(0, a);
    open(1, b);
  }

  std::vector<StreamDiff> run(std::uint64_t& damages) {
    const OpenLog& a = *sides_[0].log;
    Progress progress("diff", a.source->size());
    const log::Statistics& s = a.summary.statistics;
    const double bytes_per_ns =
        static_cast<double>(a.source->size()) /
        static_cast<double>(std::max<std::uint64_t>(1, s.message_end_time - s.message_start_time));
    while (sides_[0].next != nullptr || sides_[1].next != nullptr) {
      const bool from_b = sides_[0].next == nullptr ||
                          (sides_[1].next != nullptr && sides_[1].time() < sides_[0].time());
      DiffSide& side = sides_[from_b ? 1 : 0];
      progress.at(static_cast<std::uint64_t>(static_cast<double>(side.time()) * bytes_per_ns));
      take(from_b ? 1 : 0, *side.next);
      side.next = side.reader->next();
    }
    for (const DiffSide& side : sides_) {
      damages += report_damages(*side.log, side.reader->damages());
    }
    std::vector<StreamDiff> all;
    for (auto& [key, stream] : streams_) {
      stream.diff.only_a += stream.waiting[0].size();
      stream.diff.only_b += stream.waiting[1].size();
      if (stream.diff.a + stream.diff.b > 0) all.push_back(std::move(stream.diff));
    }
    return all;
  }

 private:
  void open(std::size_t index, const OpenLog& log) {
    DiffSide& side = sides_[index];
    side.log = &log;
    std::map<std::pair<std::string, std::string>, std::vector<std::string>> starts;
    for (const OpenChannel& c : channels_of(log)) {
      const log::Channel& channel = *c.channel;
      if (options_.topic && !options_.topic(channel.topic)) continue;
      const std::string node = sender_of(channel), start_id = start_of(channel);
      auto& known = starts[{channel.topic, node}];
      const auto before =
          static_cast<std::size_t>(std::ranges::find(known, start_id) - known.begin());
      if (before == known.size()) known.push_back(start_id);
      DiffStream& stream = streams_[{channel.topic, node, before}];
      stream.diff.topic = channel.topic;
      stream.diff.node = node;
      stream.rules = &rules_.at(channel.topic);
      (index == 0 ? stream.in_a : stream.in_b) = true;
      if (c.schema != nullptr) (index == 0 ? stream.diff.type_a : stream.diff.type_b) = c.type();
      side.streams[channel.id] = {&stream, c.schema};
    }
    side.reader = std::make_unique<log::IndexedReader>(
        *log.source, log.summary,
        log::Selection{[&side](const log::Channel& c) { return side.streams.contains(c.id); }, 0,
                       options_.end_ns});
    side.next = side.reader->next();
  }

  void take(std::size_t side, const log::Message& m) {
    const auto& [stream, schema] = sides_[side].streams.at(m.channel_id);
    StreamDiff& diff = stream->diff;
    ++(side == 0 ? diff.a : diff.b);
    if (!stream->in_a || !stream->in_b) {
      ++(side == 0 ? diff.only_a : diff.only_b);
      return;
    }
    const std::uint64_t count = ++stream->read[side];
    const std::uint64_t sequence = m.sequence != 0 ? m.sequence : count;
    auto& others = stream->waiting[1 - side];
    for (; !others.empty() && others.front().sequence < sequence; others.pop_front()) {
      ++(side == 0 ? diff.only_b : diff.only_a);
    }
    HeldMessage held{sequence, m.log_time, m.publish_time, std::string(m.data), schema};
    if (others.empty() || others.front().sequence != sequence) {
      stream->waiting[side].push_back(std::move(held));
      return;
    }
    const HeldMessage other = std::move(others.front());
    others.pop_front();
    side == 0 ? compare(*stream, held, other) : compare(*stream, other, held);
  }

  void compare(DiffStream& stream, const HeldMessage& a, const HeldMessage& b) {
    StreamDiff& diff = stream.diff;
    auto difference =
        payloads_.diff({a.bytes, a.schema}, {b.bytes, b.schema}, *stream.rules, &diff.worst);
    if (options_.times) {
      compare_time("log_time_ns", a.log_time, b.log_time, stream, difference);
      compare_time("publish_time_ns", a.publish_time, b.publish_time, stream, difference);
    }
    ++(difference.equal() ? diff.equal : diff.differing);
    if (difference.equal() || diff.first) return;
    diff.first = {a.sequence, a.log_time, b.log_time, std::move(difference)};
  }

  static void compare_time(const std::string& name, std::uint64_t a, std::uint64_t b,
                           DiffStream& stream, MessageDifference& out) {
    if (a == b) return;
    const FieldDifference line{name, std::to_string(a), std::to_string(b)};
    const auto distance = static_cast<double>(a < b ? b - a : a - b);
    WorstDifference& worst = stream.diff.worst[name];
    if (distance > worst.difference) worst = {distance, name, line.a, line.b};
    out.fields.insert(out.fields.begin(), line);
    ++out.count;
  }

  const DiffOptions& options_;
  std::map<std::string, DiffRules> rules_;  ///< by topic
  std::map<StreamKey, DiffStream> streams_;
  DiffSide sides_[2];
  PayloadDiff payloads_;
};

using Json = nlohmann::ordered_json;

Json stream_json(const StreamDiff& s, const OpenLog& a) {
  Json worst = Json::array(), fields = worst, first;
  if (s.first) {
    for (const FieldDifference& f : s.first->difference.fields) {
      fields.push_back({{"path", f.path}, {"a", f.a}, {"b", f.b}});
    }
    const std::uint64_t start = a.summary.statistics.message_start_time;
    first = {{"seq", s.first->sequence},
             {"time_s", static_cast<double>(s.first->time_a_ns - start) * 1e-9},
             {"log_time_a_ns", s.first->time_a_ns},
             {"log_time_b_ns", s.first->time_b_ns},
             {"fields", fields},
             {"differing_fields", s.first->difference.count}};
  }
  for (const auto& [field, w] : s.worst) {
    worst.push_back(
        {{"field", field},
         {"difference", std::isfinite(w.difference) ? Json(w.difference) : Json(nullptr)},
         {"path", w.path},
         {"a", w.a},
         {"b", w.b}});
  }
  return {{"topic", s.topic},   {"node", s.node},           {"type_a", s.type_a},
          {"type_b", s.type_b}, {"messages_a", s.a},        {"messages_b", s.b},
          {"equal", s.equal},   {"differing", s.differing}, {"only_a", s.only_a},
          {"only_b", s.only_b}, {"first", first},           {"worst", worst}};
}

void print_stream(const StreamDiff& s, const OpenLog& a) {
  std::cout << '\n' << printable(s.topic + (s.node.empty() ? "" : " of " + s.node)) << '\n';
  if (s.type_a != s.type_b && s.a > 0 && s.b > 0) {
    std::cout << fmt::format("  type: {} | {}\n", printable(s.type_a), printable(s.type_b));
  }
  if (s.first) {
    const auto& first = *s.first;
    std::cout << fmt::format(
        "  first difference: seq {}, at {} s\n", first.sequence,
        seconds_text(first.time_a_ns, a.summary.statistics.message_start_time));
    for (const FieldDifference& f : first.difference.fields) {
      const std::string line =
          fmt::format("    {}: {} | {}", f.path.empty() ? "payload" : f.path, f.a, f.b);
      std::cout << printable(line) << '\n';
    }
    const std::uint64_t more = first.difference.count - first.difference.fields.size();
    if (more > 0) std::cout << fmt::format("    and {} more fields\n", more);
  }
  for (const auto& [field, w] : s.worst) {
    std::cout << fmt::format("  worst of {}: {:g} ({}: {} | {})\n", field, w.difference, w.path,
                             w.a, w.b);
  }
}

void print_streams(const std::vector<StreamDiff>& streams, const OpenLog& a) {
  TextTable table({"TOPIC", "NODE", "A", "B", "EQUAL", "DIFFERING", "ONLY A", "ONLY B"});
  for (const StreamDiff& s : streams) {
    table.row({s.topic, s.node, std::to_string(s.a), std::to_string(s.b), std::to_string(s.equal),
               std::to_string(s.differing), std::to_string(s.only_a), std::to_string(s.only_b)});
  }
  table.print(std::cout, use_colour(1));
  for (const StreamDiff& s : streams) {
    const bool other_type = s.type_a != s.type_b && s.a > 0 && s.b > 0;
    if (s.first || other_type || !s.worst.empty()) print_stream(s, a);
  }
  const auto different = std::ranges::count_if(streams, [](const auto& s) { return !s.same(); });
  std::uint64_t equal = 0;
  for (const StreamDiff& s : streams) equal += s.equal;
  std::cout << (different == 0
                    ? fmt::format("\nequal: {} messages\n", equal)
                    : fmt::format("\ndifferent: {} of {} topics\n", different, streams.size()));
}

/// Which part is compared: up to a message on the topic `until`, or, unless `whole`, what two runs
/// in lock-step share. Returns the reason, for people; empty for all of the logs.
std::string limit(const std::string& path_a, const std::string& path_b, const std::string& until,
                  bool whole, DiffOptions& options) {
  const auto a = open_logs({path_a}), b = open_logs({path_b});
  const bool lockstep = !whole && in_lockstep(a) && in_lockstep(b);
  options.wall_fields = !lockstep;
  if (until.empty() && !lockstep) return {};
  for (const auto* logs : {&a, &b}) {
    if (!until.empty()) require_topic(*logs, until);
  }
  const RunLimit in_a = run_limit(a, until), in_b = run_limit(b, until);
  const RunLimit& first = in_a.until_ns <= in_b.until_ns ? in_a : in_b;
  options.end_ns = first.until_ns + 1;
  return fmt::format("up to {}: {}{}", human_time(first.until_ns), first.why,
                     lockstep ? "; without durations on the wall clock (--whole: all)" : "");
}

/// Exit code 0 if the logs are equal, 1 if not or if one is damaged.
int compare_files(const std::string& path_a, const std::string& path_b, const DiffOptions& options,
                  const std::string& part, bool json) {
  const auto logs = open_logs({path_a, path_b});
  std::uint64_t damages = 0;
  const OpenLog& a = logs.front();
  const auto streams = diff_logs(a, logs.back(), options, damages);
  if (streams.empty()) {
    throw VerbEnd{"nothing to compare: neither log has messages on the topics chosen", 3};
  }
  const bool equal = std::ranges::all_of(streams, [](const StreamDiff& s) { return s.same(); });
  if (json) {
    Json topics = Json::array();
    for (const StreamDiff& s : streams) topics.push_back(stream_json(s, a));
    print_json({{"a", path_a},
                {"b", path_b},
                {"equal", equal},
                {"damages", damages},
                {"topics", topics},
                {"part", part}});
  } else {
    print_streams(streams, a);
    if (!part.empty()) std::cout << "compared " << part << '\n';
  }
  return equal && damages == 0 ? 0 : 1;
}

}  // namespace

std::map<std::string, DiffRules> diff_rules(const DiffOptions& options, const OpenLog& a,
                                            const OpenLog& b) {
  std::map<std::string, DiffRules> rules;  // rules of every topic
  std::multimap<std::string, const google::protobuf::Descriptor*> types;
  std::vector<std::string> topics;
  LogDecoder decoder;
  for (const OpenLog* log : {&a, &b}) {
    for (const OpenChannel& c : channels_of(*log)) {
      const std::string& topic = c.channel->topic;
      if (rules.try_emplace(topic, DiffRules{.tolerance = options.tolerance}).second) {
        topics.push_back(topic);
      }
      const auto wall = wall_fields().find(c.type());
      if (!options.wall_fields && wall != wall_fields().end()) rules[topic].ignore = wall->second;
      const LogType* type = c.schema == nullptr ? nullptr : decoder.type(*c.schema);
      if (type != nullptr) types.emplace(topic, type->message().GetDescriptor());
    }
  }
  std::ranges::sort(topics);
  /// Calls `take` with the rules and the path of each field that `text` names.
  const auto each_field = [&](const std::string& text, const auto& take) {
    const bool every = text.starts_with(kEveryTopic);
    const FieldQuery query =
        every ? FieldQuery{"", text.substr(kEveryTopic.size())} : parse_field_query(text, topics);
    if (!every && query.path.empty()) {
      throw ConfigError(text + ": expected TOPIC.FIELD; see also --exclude");
    }
    bool found = false;
    std::optional<ConfigError> why;
    for (const auto& [topic, type] : types) {
      if (!every && topic != query.topic) continue;
      try {
        FieldColumns({topic, query.path}).check(*type);
        found = true;
        take(rules[topic], rule_path(query.path));
      } catch (const ConfigError& error) {
        if (!every) throw;
        why = error;
      }
    }
    if (every && !found && why) throw ConfigError(*why);
    if (!every) take(rules[query.topic], rule_path(query.path));  // no type: by its name
  };
  for (const std::string& text : options.field_tolerances) {
    const std::size_t equals = text.rfind('=');
    const auto value = equals == std::string::npos
                           ? std::nullopt
                           : runtime::to_double(std::string_view(text).substr(equals + 1));
    if (!value || *value < 0.0) {
      throw ConfigError("--field-tolerance " + text + ": expected TOPIC.FIELD=NUMBER, 0 or more");
    }
    each_field(text.substr(0, equals), [&](DiffRules& of_topic, const std::string& path) {
      of_topic.field_tolerance[path] = *value;
    });
  }
  for (const std::string& text : options.ignore) {
    each_field(text,
               [](DiffRules& of_topic, const std::string& path) { of_topic.ignore.insert(path); });
  }
  return rules;
}

bool is_runtime_topic(const std::string& topic) {
  return topic == "clock/time" || runtime::is_own_topic(topic);
}

std::vector<StreamDiff> diff_logs(const OpenLog& a, const OpenLog& b, const DiffOptions& options,
                                  std::uint64_t& damages) {
  return LogComparison(a, b, options).run(damages);
}

void add_diff(CLI::App& verb, int& exit_code) {
  CLI::App* diff = verb.add_subcommand("diff", "Compares two logs (bags) message by message");
  struct Options {
    std::string a, b;
    DiffOptions diff;
    TopicOptions topics;
    bool all_topics = false, whole = false, json = false;
    std::string until;
  };
  auto o = std::make_shared<Options>();
  diff->add_option("A", o->a, "An MCAP file")->required();
  diff->add_option("B", o->b, "Another one")->required();
  add_topic_options(*diff, o->topics);
  diff->add_flag("--all-topics", o->all_topics,
                 "Compare also */health, */log, */steps, */start and clock/time, which differ in "
                 "equal runs");
  diff->add_option("--tolerance", o->diff.tolerance,
                   "Largest difference of floating-point numbers that counts as equal")
      ->check(number_not_below_zero)
      ->capture_default_str();
  diff->add_option("--field-tolerance", o->diff.field_tolerances,
                   "TOPIC.FIELD=X: tolerance of one field, also of integers (repeatable)")
      ->allow_extra_args(false);
  diff->add_option("--ignore", o->diff.ignore,
                   "TOPIC.FIELD with all below it; *.FIELD: in every topic (repeatable)")
      ->allow_extra_args(false);
  diff->add_option("--until", o->until, "Compare up to the first message on this topic");
  diff->add_flag("--whole", o->whole,
                 "Of two lock-step runs also what differs though they are equal: all after the "
                 "first node stopped, and durations on the wall clock");
  diff->add_flag("--times", o->diff.times, "Log and publish times must be equal, too");
  diff->add_flag("--json", o->json, "One JSON object");
  diff->footer(
      "Messages are matched by topic, publishing node and sequence number. NaN is equal to NaN.\n"
      "Two runs in lock-step are compared as far as they can be equal. Exit code 0: equal, 1: "
      "different.\n"
      "Example: mimesis log diff yesterday.mcap today.mcap --tolerance 1e-9 "
      "--ignore '*.header.stamp_ns'");
  on_run(*diff, exit_code, [o] {
    const TopicFilter filter = filter_of(o->topics);
    o->diff.topic = [filter, all = o->all_topics](const std::string& topic) {
      const bool named = std::ranges::find(filter.topics(), topic) != filter.topics().end();
      return filter(topic) && (all || named || !is_runtime_topic(topic));
    };
    const std::string part = limit(o->a, o->b, o->until, o->whole, o->diff);
    return compare_files(o->a, o->b, o->diff, part, o->json);
  });
}

RunLimit run_limit(const std::vector<OpenLog>& logs, const std::string& until_topic) {
  auto verdicts = merged(
      logs, {.channel = [&](const log::Channel& channel) { return channel.topic == until_topic; }});
  if (const Item* verdict = verdicts.next()) {
    return {verdict->message->log_time, fmt::format("{} ended the run", until_topic), false};
  }
  std::optional<std::pair<std::uint64_t, std::string>> first;  // graph time, node
  auto steps = merged(logs, {.channel = [](const log::Channel& channel) {
                        return runtime::is_own_topic(channel.topic, runtime::kStepsPort);
                      }});
  v1::StepLog log;
  while (const Item* item = steps.next()) {
    if (!parse(*item, log)) continue;
    for (const v1::StepRecord& step : log.steps()) {
      if (step.kind() != v1::STEP_KIND_STOP || (first && first->first <= step.time_ns())) continue;
      first = {step.time_ns(), sender_of(*item->channel)};
    }
  }
  if (!first) return {span_of(logs).end_ns, "the log ends", true};
  return {first->first == 0 ? 0 : first->first - 1, fmt::format("node '{}' stopped", first->second),
          false};
}

const std::map<std::string, std::set<std::string>>& wall_fields() {
  static const std::map<std::string, std::set<std::string>> kFields{
      {"mimesis.v1.ClockTime", {"wall_ns"}},
      {"mimesis.v1.TaskStatus", {"plan_compute_s"}},
      {"mimesis.v1.WalkerStatus", {"mean_tick_s", "worst_tick_s"}},
      {"mimesis.v1.CrowdStatus", {"mean_step_s", "worst_step_s"}},
      {"mimesis.v1.CrowdOutcome", {"steps_1_s", "agent_steps_1_s"}}};
  return kFields;
}

bool in_lockstep(const std::vector<OpenLog>& logs) {
  bool lockstep = false;
  each_metadata(
      logs, "mimesis.launch",
      [&](const log::Metadata& launch) {
        const auto clock = launch.metadata.find("clock");
        lockstep = clock != launch.metadata.end() && clock->second == "lockstep";
      },
      /*silent=*/true);
  return lockstep;
}

}  // namespace mimesis::tool
