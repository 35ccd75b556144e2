// `mimesis log restore`: runs the nodes again whose payloads are elided in a log, and writes
// the log with the messages as they were.
#include "tools/mimesis/log/restore.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <set>

#include "tools/mimesis/log/elided_payload.h"
#include "tools/mimesis/log/rerun.h"
#include "tools/mimesis/log/rewrite.h"
#include "tools/mimesis/log/verb_options.h"

namespace mimesis::tool {
namespace {

/// A node that runs again, as far as its messages are asked for.
class Producer {
 public:
  /// @param topics of its messages that will be asked for
  Producer(const std::vector<OpenLog>& logs, const NodeRun& node_run,
           const std::set<std::string>& topics, bool unconfined)
      : node_(logs, node_run, unconfined) {
    for (const std::string& topic : topics) waiting_[topic];
  }

  /// @throws VerbEnd if the node does not publish it again
  std::string take(const std::string& topic, std::uint64_t seq) {
    auto& waiting = waiting_[topic];
    while (!waiting.contains(seq)) {
      const auto outcome = advance();
      if (!outcome) {
        throw VerbEnd{
            fmt::format("{} #{} cannot be computed again: {}", topic, seq, outcome.error().reason),
            1};
      }
      for (const v1::ReplayMessage& output : outcome->outputs()) {
        if (const auto it = waiting_.find(output.topic()); it != waiting_.end())
          it->second[logged_seq(output.seq())] = output.payload();
      }
    }
    std::string payload = std::move(waiting.at(seq));
    waiting.erase(waiting.begin(), waiting.upper_bound(seq));
    return payload;
  }

 private:
  tl::expected<v1::ReplayOutcome, Status> advance() {
    const auto step = node_.next();
    if (!step) return tl::unexpected(step.error());
    return node_.run(*step);
  }

  NodeRerun node_;
  std::map<std::string, std::map<std::uint64_t, std::string>> waiting_;  ///< by topic and seq
};

/// Makes whole messages of elided ones.
class Restorer {
 public:
  /// @param topics those that will be asked for
  /// @throws ConfigError if the log names a program that it may not, before any starts
  Restorer(const std::vector<OpenLog>& logs, const std::set<std::string>& topics, bool unconfined)
      : logs_(logs), node_runs_(find_node_runs(logs)), topics_(topics), unconfined_(unconfined) {
    for (const OpenChannel& c : channels_of(logs)) {
      const auto node_run = topics.contains(c.channel->topic) && is_elided(*c.channel)
                                ? run_of(*c.channel)
                                : node_runs_.end();
      if (node_run != node_runs_.end()) program_of(*node_run, "");
    }
  }

  /// @throws VerbEnd if it cannot be computed, or if other bytes are
  std::string whole(const Item& item) {
    const log::Channel& channel = *item.channel;
    auto& producer = producers_[{sender_of(channel), start_id_of(channel)}];
    if (producer == nullptr) producer = make(channel);
    std::string payload = producer->take(channel.topic, item.message->sequence);
    if (elide(payload) != item.message->data) {
      throw VerbEnd{fmt::format("{} #{} is computed differently here than it was recorded: another "
                                "version of the program, or another machine",
                                channel.topic, item.message->sequence),
                    1};
    }
    return payload;
  }

 private:
  std::vector<NodeRun>::const_iterator run_of(const log::Channel& channel) const {
    return std::ranges::find_if(node_runs_, [&](const NodeRun& l) {
      return l.node() == sender_of(channel) && l.start.start_id() == start_id_of(channel);
    });
  }
  std::unique_ptr<Producer> make(const log::Channel& channel) {
    const auto node_run = run_of(channel);
    if (node_run == node_runs_.end()) {
      throw VerbEnd{fmt::format("{}: its payloads are elided, but the log holds no {}/start",
                                channel.topic, sender_of(channel)),
                    1};
    }
    std::set<std::string> topics;
    for (const OpenChannel& c : channels_of(logs_)) {
      if (is_elided(*c.channel) && topics_.contains(c.channel->topic) &&
          sender_of(*c.channel) == node_run->node())
        topics.insert(c.channel->topic);
    }
    return std::make_unique<Producer>(logs_, *node_run, topics, unconfined_);
  }

  const std::vector<OpenLog>& logs_;
  std::vector<NodeRun> node_runs_;
  const std::set<std::string>& topics_;
  bool unconfined_;
  std::map<std::pair<std::string, std::uint64_t>, std::unique_ptr<Producer>> producers_;
};

std::set<std::string> elided_topics(const std::vector<OpenLog>& logs) {
  std::set<std::string> topics;
  for (const OpenChannel& c : channels_of(logs)) {
    if (is_elided(*c.channel)) topics.insert(c.channel->topic);
  }
  return topics;
}

/// Copies all messages, elided ones of these topics whole.
void restore(const std::vector<OpenLog>& logs, const std::set<std::string>& topics, NewLog& out,
             bool unconfined) {
  Restorer restorer(logs, topics, unconfined);
  std::map<const log::Channel*, log::Channel> whole;
  out.read("restore", logs, {}, [&](const Item& item) {
    if (!is_elided(*item.channel) || !topics.contains(item.channel->topic)) return out.copy(item);
    const auto [channel, fresh] = whole.try_emplace(item.channel, *item.channel);
    if (fresh)
      for (const char* key : {kElidedKey, kFormerElidedKey}) channel->second.metadata.erase(key);
    const std::string payload = restorer.whole(item);
    log::Message message = *item.message;
    message.channel_id = out.channel(channel->second, item.schema);
    message.data = payload;
    out.write(message);
  });
  out.copy_attachments(logs);
  out.copy_metadata(logs, read_losses(logs));
}

int log_restore(const RewriteOptions& options, bool unconfined) {
  const auto logs = open_logs(options.inputs);
  NewLog out(options.output, logs);
  restore(logs, elided_topics(logs), out, unconfined);
  return out.conclude(options.json);
}

}  // namespace

std::vector<OpenLog> open_whole_logs(const std::vector<std::string>& paths, bool unconfined,
                                     const std::function<bool(const std::string&)>& wanted) {
  auto logs = open_logs(paths);
  std::set<std::string> topics = elided_topics(logs);
  if (wanted) std::erase_if(topics, [&](const std::string& topic) { return !wanted(topic); });
  if (topics.empty()) return logs;
  std::cerr << fmt::format("{}: {} is computed again\n", paths.front(), fmt::join(topics, ", "));
  const TemporaryFolder folder;  // an open file needs no name
  const std::string path = folder.path() + "/whole.mcap";
  NewLog out({.path = path, .compression = log::Compression::lz4}, logs);
  restore(logs, topics, out, unconfined);
  out.finish();
  auto whole = open_logs({path});
  whole.front().path = paths.front();
  return whole;
}

void add_restore(CLI::App& log, int& exit_code) {
  CLI::App* verb = log.add_subcommand(
      "restore", "Computes the payloads again that are elided in a log (record --elide)");
  auto o = std::make_shared<RewriteOptions>();
  auto unconfined = std::make_shared<bool>(false);
  add_input_output(*verb, o->inputs, o->output);
  add_output_options(*verb, o->output);
  verb->add_flag("--json", o->json, "Print the result as one JSON object");
  verb->add_flag("--unconfined", *unconfined,
                 "Let the nodes write files and open devices and sockets");
  verb->footer(
      "Their node runs again step by step; every message is checked against the sum in the log.\n"
      "play and replay do the same by themselves.\n"
      "Example: mimesis log restore imitation.mcap whole.mcap");
  on_run(*verb, exit_code, [o, unconfined] {
    take_output(o->inputs, o->output);
    return log_restore(*o, *unconfined);
  });
}

}  // namespace mimesis::tool
