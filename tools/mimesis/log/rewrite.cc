#include "tools/mimesis/log/rewrite.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/runtime/value_text.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using nlohmann::ordered_json;

// --- filter

constexpr std::string_view kStart = "/start";  // topic of a node with v1.NodeStart

std::function<bool(const log::Channel&)> channel_filter(const FilterOptions& options) {
  const TopicFilter topics = filter_of(options);
  const std::set<std::string> nodes(options.nodes.begin(), options.nodes.end());
  return [topics, nodes](const log::Channel& channel) {
    return topics(channel.topic) && (nodes.empty() || nodes.contains(sender_of(channel)));
  };
}

/// A selection that chooses no channel is a mistake.
void check_selection(const std::vector<OpenLog>& logs, const FilterOptions& options,
                     const log::Selection& selection) {
  const auto channels = channels_of(logs);
  const auto chosen = [&](const OpenChannel& c) { return selection.channel(*c.channel); };
  if (channels.empty() || std::ranges::any_of(channels, chosen)) return;
  std::vector<std::string> nodes;
  for (const OpenChannel& c : channels) nodes.push_back(sender_of(*c.channel));
  std::string hint;
  if (!options.topics.empty())
    hint = runtime::did_you_mean(options.topics.front(), topics_of(logs));
  if (hint.empty() && !options.nodes.empty()) {
    hint = runtime::did_you_mean(options.nodes.front(), nodes);
  }
  throw ConfigError("no topic of the log is chosen" + hint);
}

/// Writes the last latched values before `start` as if they had come at that time: a player that
/// begins there knows the state.
void write_latched(const std::vector<OpenLog>& logs, const log::Selection& selection, NewLog& out) {
  struct Last {
    std::string key;
    log::Message message;
    std::string data;
  };
  std::vector<Last> last;  // last message of each topic and node
  log::MergedReader reader =
      merged(logs, {[&](const log::Channel& channel) {
                      return is_latched(channel) && selection.channel(channel);
                    },
                    0, selection.start_time});
  while (const Item* item = reader.next()) {
    const std::string key = loss_key(*item->channel);
    std::erase_if(last, [&](const Last& value) { return value.key == key; });
    last.push_back({key, *item->message, std::string(item->message->data)});
    last.back().message.channel_id = out.channel(*item->channel, item->schema);
    last.back().message.log_time = selection.start_time;
  }
  for (Last& value : last) {
    value.message.data = value.data;
    out.write(value.message);
  }
}

/// The recorder's counts of losses, for the part that is kept.
class KeptLosses {
 public:
  explicit KeptLosses(const std::vector<OpenLog>& logs) : recorded_(read_losses(logs)) {}
  void add(const Item& item) {
    LossCount& count = counted_[loss_key(*item.channel)];
    ++count.received;
    if (item.message->sequence != 0) {
      count.lost += sequences_[item.channel].next(item.message->sequence).missing;
    }
  }
  /// Empty if the recorder did not count. For a part of the time, losses are known only from the
  /// gaps.
  std::optional<LossCounts> result(bool all_times) {
    if (!recorded_) return std::nullopt;
    for (auto& [key, count] : counted_) {
      const auto recorded = recorded_->find(key);
      if (all_times && recorded != recorded_->end()) count.lost = recorded->second.lost;
    }
    return counted_;
  }

 private:
  std::optional<LossCounts> recorded_;
  LossCounts counted_;
  std::map<const log::Channel*, Sequence> sequences_;
};

/// @throws ConfigError
log::Metadata notes_of(const std::vector<std::string>& notes) {
  log::Metadata metadata{"mimesis.notes", {}};
  for (const std::string& note : notes) {
    const std::size_t equals = note.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw ConfigError("--note '" + note + "': expected KEY=VALUE");
    }
    metadata.metadata[note.substr(0, equals)] = note.substr(equals + 1);
  }
  return metadata;
}

/// Topics that a replay of `node` needs, from the messages on NODE/start: its inputs and outputs,
/// NODE/start and NODE/steps. @throws VerbEnd if the logs have no such message.
std::set<std::string> topics_for_replay(const std::vector<OpenLog>& logs, const std::string& node) {
  std::set<std::string> topics;
  const std::string start = node + std::string(kStart);
  log::MergedReader reader =
      merged(logs, {[&](const log::Channel& channel) { return channel.topic == start; }});
  while (const Item* item = reader.next()) {
    v1::NodeStart described;
    if (!parse(*item, described)) continue;
    topics.insert({start, node + "/steps"});
    for (const auto& input : described.inputs()) topics.insert(input.topic());
    for (const auto& output : described.outputs()) topics.insert(output.topic());
  }
  if (!topics.empty()) return topics;
  std::vector<std::string> nodes;
  for (const std::string& topic : topics_of(logs)) {
    if (topic.ends_with(kStart)) nodes.push_back(topic.substr(0, topic.size() - kStart.size()));
  }
  throw VerbEnd{fmt::format("--inputs-of: the log has no {}/start{}", node,
                            runtime::did_you_mean(node, nodes)),
                3};
}

constexpr double kLargestOffset_s = 1e9;

/// By input. @throws ConfigError
std::vector<std::int64_t> offsets_ns(const FilterOptions& options) {
  std::vector<std::int64_t> offsets(options.inputs.size(), 0);
  for (const std::string& text : options.offsets) {
    const std::size_t equals = std::min(text.rfind('='), text.size());
    const auto seconds = runtime::to_double(text.substr(std::min(equals + 1, text.size())));
    if (equals == 0 || !seconds || std::abs(*seconds) > kLargestOffset_s) {
      throw ConfigError(fmt::format("--offset: expected FILE=SECONDS, found '{}'", text));
    }
    const std::string file = text.substr(0, equals);
    const auto input = std::ranges::find(options.inputs, file);
    if (input == options.inputs.end()) {
      throw ConfigError(fmt::format("--offset: '{}' is not among the files to read{}", file,
                                    runtime::did_you_mean(file, options.inputs)));
    }
    offsets[static_cast<std::size_t>(input - options.inputs.begin())] =
        std::llround(*seconds * 1e9);
  }
  return offsets;
}

// --- recover

class Recovery {
 public:
  Recovery(const log::Source& in, const log::Summary& summary, NewLog& out)
      : in_(in), summary_(summary), reader_(in), out_(out) {}

  Recovered run() {
    out_.read("recover", in_, reader_, [this](const log::Record& record) { take(record); });
    conclude();
    if (result_.lost) out_.add_metadata(losses());
    return std::move(result_);
  }

 private:
  void take(const log::Record& record) {
    if (const auto* message = std::get_if<log::Message>(&record)) {
      log::Message copy = *message;
      copy.channel_id = channel(message->channel_id);
      follow(*message);
      out_.write(copy);
    } else if (std::holds_alternative<log::Schema>(record) ||
               std::holds_alternative<log::Channel>(record)) {
      ids_.clear();
    } else if (const auto* attachment = std::get_if<log::Attachment>(&record)) {
      out_.attach(*attachment);
    } else if (const auto* metadata = std::get_if<log::Metadata>(&record)) {
      out_.add_metadata(*metadata);
    } else if (std::holds_alternative<log::DataEnd>(record)) {
      data_end_ = reader_.offset();
    } else if (const auto* statistics = std::get_if<log::Statistics>(&record)) {
      statistics_ = *statistics;
    }
  }

  /// Id in the output. A channel whose definition is nowhere in the file gets a name from its id.
  std::uint16_t channel(std::uint16_t id) {
    const auto [known, fresh] = ids_.try_emplace(id, 0);
    if (!fresh) return known->second;
    const auto find = [](const auto& first, const auto& second, std::uint16_t key) {
      const auto it = first.find(key);
      if (it != first.end()) return &it->second;
      const auto other = second.find(key);
      return other == second.end() ? nullptr : &other->second;
    };
    const log::Channel* defined = find(reader_.channels(), summary_.channels, id);
    const log::Channel& chosen = name(result_.topics[id], id, defined);
    return known->second =
               out_.channel(chosen, find(reader_.schemas(), summary_.schemas, chosen.schema_id));
  }

  /// `defined` null: the definition is gone. Returns it, or what stands in for it.
  const log::Channel& name(RecoveredTopic& topic, std::uint16_t id, const log::Channel* defined) {
    placeholder_.topic = fmt::format("unknown/channel_{}", id);
    const log::Channel& chosen = defined == nullptr ? placeholder_ : *defined;
    topic.topic = chosen.topic;
    topic.node = sender_of(chosen);
    topic.placeholder = defined == nullptr;
    return chosen;
  }

  void follow(const log::Message& message) {
    RecoveredTopic& topic = result_.topics.at(message.channel_id);
    const std::uint64_t damages = reader_.damage_count();
    const Sequence::Step step =
        message.sequence == 0 ? Sequence::Step{} : topic.sequence.next(message.sequence);
    if (step.missing > 0) {
      topic.missing.push_back({message.sequence - step.missing, step.missing, topic.last_ns,
                               message.log_time, damages > topic.damages_before});
    }
    ++topic.messages;
    topic.last_ns = message.log_time;
    topic.damages_before = damages;
  }

  void conclude() {
    result_.damages = reader_.damages();
    result_.damage_count = reader_.damage_count();
    result_.complete = reader_.complete();
    for (const auto& [id, count] : statistics_.channel_message_counts) {
      if (count == 0) continue;
      RecoveredTopic& topic = result_.topics[id];
      topic.expected = count;
      result_.lost |= topic.messages != count;
      if (!topic.topic.empty()) continue;  // otherwise no message could be read
      const auto channel = summary_.channels.find(id);
      name(topic, id, channel == summary_.channels.end() ? nullptr : &channel->second);
    }
    // Behind the data stands only what can be made again; a file may end where a record does. A
    // damage at the end of the data is its sum.
    const std::uint64_t data_end = data_end_ ? *data_end_ + 1 : in_.size();
    result_.lost |= result_.damage_count > result_.damages.size();
    for (const log::Damage& d : result_.damages) result_.lost |= d.offset < data_end;
  }

  /// For the output: a later check shows why its counts do not fit.
  log::Metadata losses() const {
    log::Metadata note{kRecoveredName, {{"damages", std::to_string(result_.damage_count)}}};
    for (const auto& [id, topic] : result_.topics) {
      if (topic.expected.value_or(0) <= topic.messages) continue;
      note.metadata[fmt::format("{} ({})", topic.topic, topic.node)] =
          fmt::format("missing={}", *topic.expected - topic.messages);
    }
    return note;
  }

  const log::Source& in_;
  const log::Summary& summary_;  ///< definitions that stand behind the messages that need them
  log::StreamReader reader_;
  NewLog& out_;
  Recovered result_;
  log::Channel placeholder_;
  std::map<std::uint16_t, std::uint16_t> ids_;  ///< input -> output; void after a new definition
  std::optional<std::uint64_t> data_end_;
  log::Statistics statistics_;
};

constexpr std::size_t kRunsShown = 10;  // per topic; all are in the JSON

std::string recovered_text(const RecoveredTopic& topic) {
  std::string text;
  if (topic.placeholder) {
    text += fmt::format("{}: the definition of this channel is gone: without topic and type\n",
                        topic.topic);
  }
  const std::string name =
      topic.node.empty() ? topic.topic : fmt::format("{} ({})", topic.topic, topic.node);
  if (topic.expected && *topic.expected != topic.messages) {
    text += fmt::format("{}: {} of {} messages\n", name, topic.messages, *topic.expected);
  }
  for (std::size_t i = 0; i < topic.missing.size() && i < kRunsShown; ++i) {
    const MissingRun& run = topic.missing[i];
    text += fmt::format("{}: missing seq {} to {} ({}), between {} and {}{}\n", name, run.first_seq,
                        run.first_seq + run.messages - 1, run.messages, human_time(run.after_ns),
                        human_time(run.before_ns),
                        run.damaged ? "" : ": never recorded, the file is whole there");
  }
  if (topic.missing.size() > kRunsShown) {
    text += fmt::format("{}: and {} more gaps\n", name, topic.missing.size() - kRunsShown);
  }
  return text;
}

ordered_json recovery_json(const std::string& input, const Recovered& recovered) {
  ordered_json out{{"input", input},
                   {"complete", recovered.complete},
                   {"lost", recovered.lost},
                   {"topics", ordered_json::array()},
                   {"damages", ordered_json::array()}};
  for (const auto& [id, topic] : recovered.topics) {
    ordered_json missing = ordered_json::array();
    for (const MissingRun& run : topic.missing) {
      missing.push_back({{"first_seq", run.first_seq},
                         {"messages", run.messages},
                         {"after_ns", run.after_ns},
                         {"before_ns", run.before_ns},
                         {"damaged", run.damaged}});
    }
    out["topics"].push_back({{"topic", topic.topic},
                             {"node", topic.node},
                             {"messages", topic.messages},
                             {"expected", json_or_null(topic.expected)},
                             {"last_ns", topic.last_ns},
                             {"missing", missing}});
  }
  for (const log::Damage& d : recovered.damages) {
    out["damages"].push_back({{"offset", d.offset}, {"what", d.what}});
  }
  return out;
}

}  // namespace

int log_filter(FilterOptions options) {
  const log::Metadata notes = notes_of(options.notes);
  const auto offsets = offsets_ns(options);
  const auto logs = open_logs(options.inputs);
  if (!options.inputs_of.empty()) {
    const auto needed = topics_for_replay(logs, options.inputs_of);
    options.topics.insert(options.topics.end(), needed.begin(), needed.end());
  }
  const LogTimes times = resolve(options.range, span_of(logs));
  const log::Selection selection{channel_filter(options), times.start, times.end};
  check_selection(logs, options, selection);

  NewLog out(options.output, logs);
  KeptLosses losses(logs);
  LatchedRepeats repeats;
  if (options.latched && times.start > 0) write_latched(logs, selection, out);
  out.read(
      "filter", logs, selection,
      [&](const Item& item) {
        if (repeats.repeated(item)) return;
        losses.add(item);
        out.copy(item);
      },
      offsets);
  if (options.attachments) out.copy_attachments(logs);
  if (options.metadata) out.copy_metadata(logs, losses.result(options.range.whole()));
  if (!notes.metadata.empty()) out.add_metadata(notes);
  for (const std::string& schema : out.conflicts()) {
    std::cerr << fmt::format("{} is defined differently in the inputs: kept apart\n", schema);
  }
  return out.conclude(options.json, {{"conflicts", ordered_json(out.conflicts())}});
}

Recovered recover(const log::Source& in, const log::Summary& summary, NewLog& out) {
  return Recovery(in, summary, out).run();
}

std::string recovery_text(const std::string& input, const Recovered& recovered) {
  std::string text;
  for (const log::Damage& d : recovered.damages) {
    text += fmt::format("{}: byte {}: {}\n", input, d.offset, d.what);
  }
  if (recovered.damage_count > recovered.damages.size()) {
    text +=
        fmt::format("{}: and {} more\n", input, recovered.damage_count - recovered.damages.size());
  }
  std::uint64_t last = 0;
  for (const auto& [id, topic] : recovered.topics) {
    text += recovered_text(topic);
    last = std::max(last, topic.last_ns);
  }
  if (!recovered.complete) {
    text += fmt::format("{}: was not closed: what came after {} is not in the file\n", input,
                        human_time(last));
  }
  return text;
}

int log_recover(const RewriteOptions& options) {
  const std::string& input = options.inputs.front();
  const auto source = log::open_file(input);
  if (!source) throw VerbEnd{source.error().reason, 3};
  const auto summary = log::summarize(**source);
  if (!summary) throw VerbEnd{input + ": " + summary.error().reason, 1};
  NewLog out(options.output, options.inputs, summary->header.profile);
  const Recovered recovered = recover(**source, *summary, out);
  out.finish(/*verify=*/true);
  std::cerr << recovery_text(input, recovered) << out.line() << ", read back: whole\n";
  if (options.json) {
    auto object = out.json();
    object.update(recovery_json(input, recovered));
    print_json(object);
  }
  return recovered.lost ? 1 : 0;
}

void add_filter(CLI::App& verb, int& exit_code) {
  CLI::App* filter = verb.add_subcommand(
      "filter",
      "Writes a part of logs, or several joined, into a new one (like ros2 bag convert, mcap "
      "filter|merge|compress|decompress)");
  auto o = std::make_shared<FilterOptions>();
  add_input_output(*filter, o->inputs, o->output);
  add_topic_options(*filter, *o);
  filter->add_option("--node", o->nodes, "Only what this node published (repeatable)")
      ->allow_extra_args(false);
  filter->add_option("--inputs-of", o->inputs_of,
                     "Messages for a replay of this node: the topics that its NODE/start names, "
                     "NODE/start and NODE/steps");
  add_time_options(*filter, o->range);
  filter->add_option("--duration", o->range.duration, "Length of log time from --start on");
  filter->add_flag("--latched,!--no-latched", o->latched,
                   "Begin with the last values of latched topics before --start (default)");
  filter->add_flag("!--no-attachments", o->attachments, "Leave attachments out");
  filter->add_flag("!--no-metadata", o->metadata, "Leave metadata out");
  filter->add_option("--note", o->notes, "Stores KEY=VALUE in the log, say its source (repeatable)")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  filter
      ->add_option("--offset", o->offsets,
                   "FILE=SECONDS, added to the log and publish times of a file whose host had "
                   "another clock (repeatable)")
      ->allow_extra_args(false);
  add_output_options(*filter, o->output);
  filter->add_flag("--json", o->json, "Print the result as one JSON object");
  filter->footer(
      "Channels of one topic, type and metadata become one. Latched values that parts of a split\n"
      "recording repeat are written once. Stamps inside of messages stay as they are.\n"
      "Exit code 1 if an input is damaged.\n"
      "Examples:\n  mimesis log filter run.mcap images.mcap --topic camera/image\n"
      "  mimesis log filter run.mcap -o part.mcap --start 12.5 --duration 3\n"
      "  mimesis log filter run.mcap -o planner.mcap --inputs-of planner\n"
      "  mimesis log filter run_000.mcap run_001.mcap -o run.mcap\n"
      "  mimesis log filter robot.mcap vision.mcap -o both.mcap --offset vision.mcap=-0.012\n"
      "  mimesis log filter run.mcap -o small.mcap --compression zstd --level 19   (compress)\n"
      "  mimesis log filter run.mcap -o plain.mcap --compression none   (decompress)");
  on_run(*filter, exit_code, [o] {
    take_output(o->inputs, o->output);
    return log_filter(*o);
  });
}

void add_recover(CLI::App& verb, int& exit_code) {
  CLI::App* recover = verb.add_subcommand(
      "recover",
      "Writes the readable part of a damaged log into a new one (like mcap recover, ros2 bag "
      "reindex)");
  auto o = std::make_shared<RewriteOptions>();
  add_input_output(*recover, o->inputs, o->output);
  add_output_options(*recover, o->output);
  recover->add_flag("--json", o->json, "Print the missing parts as one JSON object");
  recover->footer(
      "The output is read back and compared before it gets its name; the input is never changed.\n"
      "Exit code 0: nothing that was in the file is missing (a log that was not closed ends "
      "early,\n"
      "that is all); 1: the output is good, but something is missing: standard error says what.\n"
      "Logs of a killed recorder open without this.\n"
      "Example: mimesis log recover broken.mcap -o whole.mcap");
  on_run(*recover, exit_code, [o] {
    take_output(o->inputs, o->output);
    if (o->inputs.size() != 1) throw ConfigError("expected one log to recover");
    return log_recover(*o);
  });
}

}  // namespace mimesis::tool
