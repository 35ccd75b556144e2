#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>

#include "common/error.h"
#include "common/runtime/value_text.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/log/new_log.h"
#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/log/rewrite.h"
#include "tools/mimesis/log/verb_options.h"

namespace mimesis::tool {
namespace {

std::pair<std::string, std::string> topic_and_number(const std::string& text) {
  const std::size_t equals = text.rfind('=');
  if (equals == std::string::npos) return {"", text};
  return {text.substr(0, equals), text.substr(equals + 1)};
}

constexpr std::string_view kStart = "/start";  // of a node: v1.NodeStart

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
  const auto topics = topics_of(logs);
  std::vector<std::string> nodes;
  for (const OpenChannel& c : channels) nodes.push_back(sender_of(*c.channel));
  std::string hint;
  if (!options.topics.empty()) hint = runtime::did_you_mean(options.topics.front(), topics);
  if (hint.empty() && !options.nodes.empty()) {
    hint = runtime::did_you_mean(options.nodes.front(), nodes);
  }
  throw ConfigError("no topic of the log is chosen" + hint);
}

/// Writes the last latched values before `start` as if they had come at that time: a player that
/// begins there knows the state.
log::Result write_latched(const std::vector<OpenLog>& logs, const log::Selection& selection,
                          NewLog& out) {
  struct Last {
    log::Message message;
    std::string data;
    std::uint64_t order = 0;
  };
  std::map<std::pair<std::string, std::string>, Last> last;  // by topic and node
  std::uint64_t order = 0;
  const log::Selection before{[&](const log::Channel& channel) {
                                return is_latched(channel) && selection.channel(channel);
                              },
                              0, selection.start_time};
  log::MergedReader reader = merged(logs, before);
  while (const Item* item = reader.next()) {
    const auto id = out.channel(*item->channel, item->schema);
    if (!id) return tl::unexpected(id.error());
    Last& value = last[{item->channel->topic, sender_of(*item->channel)}];
    value.message = *item->message;
    value.message.channel_id = *id;
    value.message.log_time = selection.start_time;
    value.data.assign(item->message->data);
    value.order = ++order;
  }
  std::vector<Last*> values;
  for (auto& [key, value] : last) values.push_back(&value);
  std::ranges::sort(values, {}, &Last::order);
  for (Last* value : values) {
    value->message.data = value->data;
    if (auto done = out.write(value->message); !done) return done;
  }
  return {};
}

/// What the recorder said about losses, for the part that is kept.
class KeptLosses {
 public:
  KeptLosses(const std::vector<OpenLog>& logs, bool all_times) : all_times_(all_times) {
    if (const auto losses = read_losses(logs)) {
      recorded_ = *losses;
      known_ = true;
    }
  }
  void add(const Item& item, bool kept) {
    LossCount& count = counted_[loss_key(*item.channel)];
    count.received += kept ? 1 : 0;
    if (item.message->sequence != 0) {
      count.lost += sequences_[item.channel].next(item.message->sequence).missing;
    }
  }
  /// In a part of the time what was lost is known from the gaps alone.
  LossCounts result() const {
    LossCounts counts = counted_;
    for (auto& [key, count] : counts) {
      const auto recorded = recorded_.find(key);
      if (all_times_ && recorded != recorded_.end()) count.lost = recorded->second.lost;
    }
    return counts;
  }
  bool known() const { return known_; }

 private:
  bool all_times_, known_ = false;
  LossCounts recorded_, counted_;
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

VerbEnd unknown_node(const std::vector<OpenLog>& logs, const std::string& node) {
  std::vector<std::string> nodes;
  for (const std::string& topic : topics_of(logs)) {
    if (topic.ends_with(kStart)) nodes.push_back(topic.substr(0, topic.size() - kStart.size()));
  }
  return {fmt::format("--inputs-of: the log has no {}/start{}", node,
                      runtime::did_you_mean(node, nodes)),
          3};
}

/// Topics that a replay of `node` needs, from the messages on NODE/start: what it reads and writes,
/// NODE/start and NODE/steps. Empty if the logs have no such message.
std::set<std::string> topics_for_replay(const std::vector<OpenLog>& logs, const std::string& node) {
  std::set<std::string> topics;
  const std::string start = node + std::string(kStart);
  log::MergedReader reader =
      merged(logs, {[&](const log::Channel& channel) { return channel.topic == start; }});
  while (const Item* item = reader.next()) {
    v1::NodeStart described;
    const std::string_view data = item->message->data;
    if (!described.ParseFromArray(data.data(), static_cast<int>(data.size()))) continue;
    topics.insert({start, node + "/steps"});
    for (const auto& input : described.inputs()) topics.insert(input.topic());
    for (const auto& output : described.outputs()) topics.insert(output.topic());
  }
  return topics;
}

}  // namespace

Thinning::Thinning(const std::vector<std::string>& every,
                   const std::vector<std::string>& max_rate) {
  for (const std::string& text : every) {
    const auto [topic, number] = topic_and_number(text);
    const auto n = runtime::to_int(number);
    if (!n || *n < 1) {
      throw ConfigError(fmt::format("--every: expected N or TOPIC=N from 1, found '{}'", text));
    }
    every_[topic] = static_cast<std::uint64_t>(*n);
  }
  for (const std::string& text : max_rate) {
    const auto [topic, number] = topic_and_number(text);
    const auto hz = runtime::to_double(number);
    if (!hz || *hz < 1e-6 || *hz > 1e9) {
      throw ConfigError(
          fmt::format("--max-rate: expected HZ or TOPIC=HZ above 0, found '{}'", text));
    }
    period_ns_[topic] = static_cast<std::uint64_t>(std::llround(1e9 / *hz));
  }
}

Thinning::State Thinning::state_of(const log::Channel& channel) const {
  const auto value = [&](const auto& map, std::uint64_t otherwise) {
    auto it = map.find(channel.topic);
    if (it == map.end() && !is_latched(channel)) it = map.find("");
    return it == map.end() ? otherwise : it->second;
  };
  return {value(every_, 1), 0, value(period_ns_, 0), 0};
}

bool Thinning::keep(const log::Channel& channel, std::uint64_t log_time) {
  auto it = states_.find(&channel);
  if (it == states_.end()) it = states_.emplace(&channel, state_of(channel)).first;
  State& s = it->second;
  if (s.seen++ % s.every != 0) return false;
  if (s.period_ns == 0) return true;
  if (log_time < s.due_ns) return false;
  // The times that are due form a grid, so that 100 Hz become 30 on average, not 25; after a pause
  // the grid begins anew.
  s.due_ns = std::max(s.due_ns, log_time - std::min(log_time, s.period_ns)) + s.period_ns;
  if (s.due_ns <= log_time) s.due_ns = log_time + s.period_ns;
  return true;
}

int log_filter(FilterOptions options) {
  Thinning thinning(options.every, options.max_rate);
  const log::Metadata notes = notes_of(options.notes);
  const auto logs = opened(options.inputs);
  if (!options.inputs_of.empty()) {
    const auto needed = topics_for_replay(logs, options.inputs_of);
    if (needed.empty()) throw unknown_node(logs, options.inputs_of);
    options.topics.insert(options.topics.end(), needed.begin(), needed.end());
  }
  const LogTimes times = resolve(options.range, span_of(logs));
  const log::Selection selection{channel_filter(options), times.start, times.end};
  check_selection(logs, options, selection);

  options.output.profile = common_profile(logs);
  NewLog out(options.output, options.inputs);
  KeptLosses losses(logs, options.range.whole());
  LatchedRepeats repeats;
  Pass latched;
  if (options.latched && times.start > 0) latched.done = write_latched(logs, selection, out);
  Pass pass =
      !latched.done ? latched : each_message("filter", logs, selection, [&](const Item& item) {
        if (repeats.repeated(item)) return log::Result{};
        const bool keep = thinning.keep(*item.channel, item.message->log_time);
        losses.add(item, keep);
        return keep ? out.copy(item) : log::Result{};
      });
  if (options.attachments) copy_attachments(logs, out, pass);
  if (options.metadata) {
    copy_metadata(logs, out, pass, losses.known() ? losses.result() : std::optional<LossCounts>{});
  }
  if (pass.done && !notes.metadata.empty()) pass.done = out.add_metadata(notes);
  return conclude(out, pass, options.json);
}

void add_filter(CLI::App& verb, int& exit_code) {
  CLI::App* filter = verb.add_subcommand(
      "filter",
      "Writes a part of logs into a new one (like ros2 bag convert, mcap filter|compress|"
      "decompress)");
  auto o = std::make_shared<FilterOptions>();
  add_input_output(*filter, o->inputs, o->output);
  add_topic_options(*filter, *o);
  filter->add_option("--node", o->nodes, "Only what this node published (repeatable)")
      ->allow_extra_args(false);
  filter->add_option("--inputs-of", o->inputs_of,
                     "What a replay of this node needs: the topics that it reads and writes by its "
                     "NODE/start, NODE/start and NODE/steps");
  add_time_options(*filter, o->range);
  filter->add_option("--duration", o->range.duration, "So many seconds from --start on");
  filter->add_flag("--latched,!--no-latched", o->latched,
                   "Begin with the last values of latched topics before --start (default)");
  filter
      ->add_option("--every", o->every,
                   "Keep every Nth message of each topic, or TOPIC=N (repeatable)")
      ->allow_extra_args(false);
  filter
      ->add_option("--max-rate", o->max_rate,
                   "Keep at most so many a second of each topic, or TOPIC=HZ (repeatable)")
      ->allow_extra_args(false);
  filter->add_flag("!--no-attachments", o->attachments, "Leave attachments out");
  filter->add_flag("!--no-metadata", o->metadata, "Leave metadata out");
  filter
      ->add_option("--note", o->notes, "Stores KEY=VALUE in the log: where it is from (repeatable)")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  add_output_options(*filter, o->output);
  filter->add_flag("--json", o->json, "Print what was written as one JSON object");
  filter->footer(
      "Thinning leaves latched topics alone unless they are named. Exit code 1 if an input is "
      "damaged.\n"
      "Examples:\n  mimesis log filter run.mcap images.mcap --topic camera/image --max-rate 5\n"
      "  mimesis log filter run.mcap -o part.mcap --start 12.5 --duration 3\n"
      "  mimesis log filter run.mcap -o planner.mcap --inputs-of planner\n"
      "  mimesis log filter run.mcap -o small.mcap --compression zstd --level 19   (compress)\n"
      "  mimesis log filter run.mcap -o plain.mcap --compression none   (decompress)");
  on_run(*filter, exit_code, [o] {
    take_output(o->inputs, o->output);
    return log_filter(*o);
  });
}

}  // namespace mimesis::tool
