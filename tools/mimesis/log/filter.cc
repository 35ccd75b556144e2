#include "tools/mimesis/log/filter.h"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>

#include "common/runtime/suggest.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/log/latched_repeats.h"
#include "tools/mimesis/log/loss_counts.h"
#include "tools/mimesis/log/rewriting.h"
#include "tools/mimesis/log/sequence.h"

namespace mimesis::tool {
namespace {

using Item = log::MergedReader::Item;

constexpr std::string_view kStart = "/start";  // of a node: v1.NodeStart

std::function<bool(const log::Channel&)> channel_filter(const FilterOptions& options) {
  const TopicFilter topics(options.topics, options.regex, options.exclude);
  const std::set<std::string> nodes(options.nodes.begin(), options.nodes.end());
  return [topics, nodes](const log::Channel& channel) {
    return topics(channel.topic) && (nodes.empty() || nodes.contains(sender_of(channel)));
  };
}

/// A selection that chooses no channel is a mistake.
void check_selection(const std::vector<OpenLog>& logs, const FilterOptions& options,
                     const log::Selection& selection) {
  std::vector<std::string> topics, nodes;
  bool any = false, empty = true;
  for (const OpenLog& log : logs) {
    for (const auto& [id, channel] : log.summary.channels) {
      empty = false;
      any |= selection.channel(channel);
      topics.push_back(channel.topic);
      nodes.push_back(sender_of(channel));
    }
  }
  if (any || empty) return;
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

int not_in_log(const std::vector<OpenLog>& logs, const std::string& node) {
  std::vector<std::string> nodes;
  for (const OpenLog& log : logs) {
    for (const auto& [id, channel] : log.summary.channels) {
      if (!channel.topic.ends_with(kStart)) continue;
      nodes.push_back(channel.topic.substr(0, channel.topic.size() - kStart.size()));
    }
  }
  std::cerr << fmt::format("--inputs-of: the log has no {}/start{}\n", node,
                           runtime::did_you_mean(node, nodes));
  return 3;
}

}  // namespace

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

int log_filter(FilterOptions options) {
  Thinning thinning(options.every, options.max_rate);
  const log::Metadata notes = notes_of(options.notes);
  const auto logs = open_logs(options.inputs);
  if (!logs) {
    std::cerr << logs.error().line << '\n';
    return logs.error().exit_code;
  }
  if (!options.inputs_of.empty()) {
    const auto needed = topics_for_replay(*logs, options.inputs_of);
    if (needed.empty()) return not_in_log(*logs, options.inputs_of);
    options.topics.insert(options.topics.end(), needed.begin(), needed.end());
  }
  const LogTimes times = resolve(options.range, span_of(*logs));
  const log::Selection selection{channel_filter(options), times.start, times.end};
  check_selection(*logs, options, selection);

  options.output.profile = common_profile(*logs);
  NewLog out(options.output, options.inputs);
  KeptLosses losses(*logs, options.range.whole());
  LatchedRepeats repeats;
  Pass latched;
  if (options.latched && times.start > 0) latched.done = write_latched(*logs, selection, out);
  Pass pass =
      !latched.done ? latched : each_message("filter", *logs, selection, [&](const Item& item) {
        if (repeats.repeated(item)) return log::Result{};
        const bool keep = thinning.keep(*item.channel, item.message->log_time);
        losses.add(item, keep);
        return keep ? out.copy(item) : log::Result{};
      });
  if (options.attachments) copy_attachments(*logs, out, pass);
  if (options.metadata) {
    copy_metadata(*logs, out, pass, losses.known() ? losses.result() : std::optional<LossCounts>{});
  }
  if (pass.done && !notes.metadata.empty()) pass.done = out.add_metadata(notes);
  return conclude(out, pass, options.json);
}

}  // namespace mimesis::tool
