// A recorded lock-step run, launched again.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <iostream>
#include <sstream>
#include <tuple>

#include "common/runtime/own_topics.h"
#include "common/runtime/raw.h"
#include "common/time.h"
#include "tools/mimesis/launch/check.h"
#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/launch/graph_file.h"
#include "tools/mimesis/log/packet_process.h"
#include "tools/mimesis/log/replay.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr auto kListen = 50ms;
/// In a log that was cut off, nodes may be this far apart.
constexpr std::uint64_t kRaggedEnd = 1'000'000'000;
double ns_to_s(std::uint64_t ns) { return static_cast<double>(ns) * 1e-9; }

/// Arguments and sets of the recorded run; false if the log does not tell.
bool read_launch_metadata(const std::vector<OpenLog>& logs, LaunchPlan& plan) {
  bool told = false;
  const auto take = [&](const log::Metadata& launch) {
    if (std::exchange(told, true)) return;
    for (const auto& [key, lines] : {std::pair{"args", &plan.args}, {"sets", &plan.sets}}) {
      const auto it = launch.metadata.find(key);
      std::istringstream in(it == launch.metadata.end() ? "" : it->second);
      for (std::string line; std::getline(in, line);) {
        if (!line.empty()) lines->push_back(line);
      }
    }
  };
  each_metadata(logs, "mimesis.launch", take, /*silent=*/true);
  std::erase_if(plan.args, [](const std::string& arg) { return arg.starts_with("log="); });
  return told;
}

/// The launch would overwrite the log that it is compared with.
void refuse_overwriting(const launch::GraphFile& graph, const std::vector<OpenLog>& logs) {
  for (const launch::NodeSpec& node : graph.nodes) {
    for (const launch::Text& word : node.args) {
      for (const OpenLog& log : logs) {
        std::error_code ignored;
        if (!fs::equivalent(word.text, log.path, ignored)) continue;
        throw ConfigError(fmt::format("{}: node '{}' names {}, the log to be replayed", graph.file,
                                      node.name.text, log.path));
      }
    }
  }
}

/// For the checks of a launch alone.
launch::Run as_run(const std::vector<std::string>& sets) {
  launch::Run run{.graph = "replay", .log = "/nowhere", .sets = {}};
  for (const std::string& set : sets) {
    const std::size_t dot = set.find('.');
    if (dot == std::string::npos || set.find('=', dot) == std::string::npos) {
      throw ConfigError("--set: '" + set + "' is not NODE.KEY=VALUE");
    }
    run.sets.emplace_back(set.substr(0, dot), set.substr(dot + 1));
  }
  return run;
}

/// A graph run by `mimesis launch`, all of whose messages are received. It is stopped, and its
/// files are removed, with this object.
class ReplayGraph {
 public:
  /// @param accept  topics that are wanted
  /// @throws std::runtime_error if it cannot be started
  ReplayGraph(const LaunchPlan& plan, std::function<bool(const std::string& topic)> accept)
      : graph_(new_name()),
        directory_(runtime::graph_directory(graph_)),
        // Before the first node: publishers wait for a reliable subscriber that is there.
        tap_(std::in_place, graph_, std::move(accept), runtime::Policy::reliable),
        launch_(command(plan)) {}
  ~ReplayGraph() {
    constexpr auto kAtMost = 20s;  // the launcher itself kills its nodes after some seconds
    tap_.reset();                  // no publisher waits for it any more
    launch_.send(SIGINT);
    launch_.wait(kAtMost);
    std::error_code ignored;
    fs::remove_all(directory_, ignored);
  }
  ReplayGraph(const ReplayGraph&) = delete;
  ReplayGraph& operator=(const ReplayGraph&) = delete;

  /// Next message; nothing after `timeout`.
  std::optional<runtime::Tapped> next(std::chrono::milliseconds timeout) {
    return tap_->next(timeout);
  }
  launch::OwnProcess& launch() { return launch_; }

 private:
  static std::string new_name() {
    static std::atomic<int> count{0};
    return fmt::format("replay-{}-{}", getpid(), ++count);
  }
  launch::Command command(const LaunchPlan& plan) const {
    launch::Command c;
    c.argv = {"mimesis-launch", plan.file, "--graph", graph_, "--name", "replay"};
    for (const std::string& arg : plan.args) c.argv.insert(c.argv.end(), {"--arg", arg});
    if (plan.takes_log) {
      c.argv.insert(c.argv.end(), {"--arg", "log=" + folder_.path() + "/run.mcap"});
    }
    for (const std::string& set : plan.sets) c.argv.insert(c.argv.end(), {"--set", set});
    c.env = {{"XDG_STATE_HOME", folder_.path()}};  // the run leaves nothing behind
    return c;
  }

  TemporaryFolder folder_;  ///< for the run's own logs
  std::string graph_;
  std::string directory_;  ///< directory of the graph's sockets
  std::optional<runtime::Tap> tap_;
  launch::OwnProcess launch_;
};

/// Topic and node that publishes on it.
using TopicOfNode = std::pair<std::string, std::string>;

/// The messages of a recorded run in the order of each topic of each node, read as they are asked
/// for. Without the topics that every node has about itself.
class RecordedRun {
 public:
  /// @param until_ns  last log time that counts. The logs outlive the object.
  RecordedRun(const std::vector<OpenLog>& logs, std::uint64_t until_ns)
      : reader_(merged(logs, {.channel =
                                  [](const log::Channel& channel) {
                                    return !runtime::is_own_topic(channel.topic);
                                  },
                              .end_time = until_ns + 1})) {
    for (const OpenChannel& c : channels_of(logs)) {
      if (!runtime::is_own_topic(c.channel->topic)) {
        waiting_[{c.channel->topic, sender_of(*c.channel)}];
      }
    }
  }

  bool has(const TopicOfNode& key) const { return waiting_.contains(key); }
  /// The next one if its log time is `time_ns` at most (or it was read already), or nothing.
  std::optional<KeptMessage> next(const TopicOfNode& key, std::uint64_t time_ns) {
    const auto track = waiting_.find(key);
    if (track == waiting_.end()) return std::nullopt;
    auto& messages = track->second.messages;
    while (messages.empty()) {
      if (log_time_ns_ > time_ns || !read()) return std::nullopt;
    }
    if (messages.front().log_time_ns > time_ns) return std::nullopt;
    KeptMessage message = std::move(messages.front());
    messages.pop_front();
    --waiting_count_;
    return message;
  }
  /// All were asked for.
  bool finished() {
    while (waiting_count_ == 0) {
      if (!read()) return true;
    }
    return false;
  }
  /// The earliest that was not asked for; null if there is none. Reads no further.
  const KeptMessage* earliest(TopicOfNode& key) const {
    const KeptMessage* first = nullptr;
    for (const auto& [name, track] : waiting_) {
      if (track.messages.empty()) continue;
      const KeptMessage& message = track.messages.front();
      if (first != nullptr && first->log_time_ns <= message.log_time_ns) continue;
      first = &message;
      key = name;
    }
    return first;
  }

  std::uint64_t log_time_ns() const { return log_time_ns_; }  ///< read so far

 private:
  struct Track {
    std::deque<KeptMessage> messages;
    std::map<std::uint64_t, std::uint64_t> last_seq;  ///< by start_id
  };
  bool read() {
    const Item* item = reader_.next();
    if (item == nullptr) return false;
    log_time_ns_ = item->message->log_time;
    Track& track = waiting_[{item->channel->topic, sender_of(*item->channel)}];
    std::uint64_t& last = track.last_seq[start_id_of(*item->channel)];
    if (item->message->sequence <= last) return true;  // repeated at the head of a split
    last = item->message->sequence;
    track.messages.emplace_back(*item);
    ++waiting_count_;
    return true;
  }

  std::map<TopicOfNode, Track> waiting_;
  std::size_t waiting_count_ = 0;
  std::uint64_t log_time_ns_ = 0;
  log::MergedReader reader_;
};

/// One run of the launch file beside the recorded one.
class LaunchReplay {
 public:
  LaunchReplay(const std::vector<OpenLog>& logs, const LaunchPlan& plan,
               const ReplayOptions& options)
      : plan_(plan),
        options_(options),
        recorded_(logs, plan.limit.until_ns),
        messages_(options.tolerance, wall_fields()) {}

  ReplayReport run(const StopSignals& stop, const ReplayProgress& progress) {
    const auto started = std::chrono::steady_clock::now();
    ReplayGraph graph(plan_,
                      [](const std::string& topic) { return !runtime::is_own_topic(topic); });
    while (!stop.requested() && listen(graph)) progress(recorded_.log_time_ns());
    finish(stop);
    report_.wall_s = to_seconds(std::chrono::steady_clock::now() - started);
    return std::move(report_);
  }

 private:
  /// False when all is known.
  bool listen(ReplayGraph& graph) {
    const bool ended = graph.launch().ending().has_value();
    const auto now = std::chrono::steady_clock::now();
    if (const auto tapped = graph.next(kListen)) {
      heard_ = now;
      take(*tapped);
      return !enough() && !recorded_.finished();
    }
    if (ended) return report_end(graph.launch());
    if (to_seconds(now - heard_) < options_.timeout_s) return true;
    report_.result = ReplayResult::timed_out;
    report_.problem =
        fmt::format("no message came for {} s, the last one at {:.6f} s of graph time",
                    options_.timeout_s, last_s_);
    return false;
  }

  /// The launch ended, no message is in transit any more, and the log continues.
  bool report_end(launch::OwnProcess& run) {
    const launch::Ending& how = *run.ending();
    if (report_.counts.outputs == 0 && how.exit_code() == 2) throw ConfigError(run.last_words());
    TopicOfNode key;
    const KeptMessage* next = recorded_.earliest(key);
    report_.problem = fmt::format("the launch {} at {:.6f} s of graph time", how.text(), last_s_);
    if (next != nullptr) {
      report_.problem += fmt::format(", before {} #{} of node '{}' at {:.6f} s", key.first,
                                     next->seq, key.second, ns_to_s(next->log_time_ns));
    }
    if (!how.good()) report_.problem += ":\n" + run.last_words();
    return false;
  }

  void take(const runtime::Tapped& live) {
    const runtime::Received& m = live.message;
    const auto time_ns =
        static_cast<std::uint64_t>((live.tick.count() > 0 ? live.tick : m.stamp).count());
    if (time_ns > plan_.limit.until_ns) return;
    last_s_ = std::max(last_s_, ns_to_s(time_ns));
    const TopicOfNode key{live.topic, m.source};
    if (!recorded_.has(key)) {
      ++left_out_[key];
      return;
    }
    const auto recorded = recorded_.next(key, time_ns);
    const std::string place = fmt::format("{} #{}", live.topic, m.seq);
    if (!recorded) {
      if (plan_.limit.cut_off && time_ns + kRaggedEnd > plan_.limit.until_ns) return;
      differs(live, time_ns, place + ": the log holds no such message", {});
      return;
    }
    ++report_.counts.outputs;
    report_.counts.bytes += m.payload.size();
    MessageDifference fields =
        messages_.compare(live.topic, recorded->schema, recorded->payload, m.payload);
    compare_numbers(fields, "(publish time) ns", recorded->publish_time_ns,
                    static_cast<std::uint64_t>(m.stamp.count()));
    compare_numbers(fields, "(graph time) ns", recorded->log_time_ns, time_ns);
    compare_numbers(fields, "(seq)", recorded->seq, m.seq);
    if (fields.equal()) return;
    differs(live, time_ns, fmt::format("{} of node '{}' differs", place, m.source),
            std::move(fields));
  }

  /// The earliest differences in graph time are shown, in any order of arrival from the nodes.
  void differs(const runtime::Tapped& live, std::uint64_t time_ns, std::string what,
               MessageDifference fields) {
    ++report_.difference_count;
    ReplayDifference d;
    d.time_s = ns_to_s(time_ns);
    d.what = std::move(what);
    d.topic = live.topic;
    d.seq = live.message.seq;
    d.fields = std::move(fields);
    auto& shown = report_.differences;
    const auto later = [](const ReplayDifference& a, const ReplayDifference& b) {
      return std::tie(a.time_s, a.topic) < std::tie(b.time_s, b.topic);
    };
    shown.insert(std::upper_bound(shown.begin(), shown.end(), d, later), std::move(d));
    if (shown.size() > options_.differences) shown.pop_back();
  }

  /// No step still running can come before the messages to be shown.
  bool enough() {
    if (report_.difference_count < options_.differences) return false;
    if (recorded_.finished()) return true;
    const double latest_s = report_.differences.back().time_s;
    if (last_s_ > latest_s + ns_to_s(kRaggedEnd)) return true;  // a topic may have fallen silent
    TopicOfNode key;
    const KeptMessage* next = recorded_.earliest(key);  // not null: not finished
    return next != nullptr && ns_to_s(next->log_time_ns) > latest_s;
  }

  void finish(const StopSignals& stop) {
    report_.graph_s = last_s_;
    report_.tolerated = messages_.tolerated();
    report_.notes.push_back(
        fmt::format("compared up to {:.6f} s: {}", ns_to_s(plan_.limit.until_ns), plan_.limit.why));
    for (const auto& [key, count] : left_out_) {
      report_.notes.push_back(
          fmt::format("{} of node '{}' is not in the log: {} messages were not compared", key.first,
                      key.second, count));
    }
    if (report_.result == ReplayResult::equal && !report_.problem.empty()) {
      report_.result = ReplayResult::incomplete;
    }
    if (report_.difference_count > 0) report_.result = ReplayResult::different;
    if (stop.requested()) report_.result = ReplayResult::interrupted;
  }

  const LaunchPlan& plan_;
  const ReplayOptions& options_;
  RecordedRun recorded_;
  ReplayCompare messages_;
  ReplayReport report_;
  std::map<TopicOfNode, std::uint64_t> left_out_;
  double last_s_ = 0.0;  ///< graph time
  std::chrono::steady_clock::time_point heard_ = std::chrono::steady_clock::now();
};

}  // namespace

LaunchPlan plan_launch(const std::vector<OpenLog>& logs, const ReplayOptions& options) {
  LaunchPlan plan;
  plan.file = options.launch;
  if (!read_launch_metadata(logs, plan)) {
    std::cerr << fmt::format(
        "{}: it does not tell how the run was started (no metadata mimesis.launch): the defaults "
        "of {} are taken\n",
        logs.front().path, options.launch);
  }
  plan.args.insert(plan.args.end(), options.args.begin(), options.args.end());
  plan.sets.insert(plan.sets.end(), options.sets.begin(), options.sets.end());
  launch::Mistakes mistakes;
  const launch::GraphFile graph =
      launch::read_graph_file(options.launch, plan.args, "/nowhere", mistakes);
  const launch::Run run = as_run(plan.sets);
  launch::check_graph(graph, run, /*whole=*/true, mistakes);
  if (!mistakes.empty()) throw ConfigError(fmt::format("{}", fmt::join(mistakes.lines(), "\n")));
  if (graph.clock != "lockstep") {
    throw ConfigError(
        fmt::format("{}: its clock is '{}': only lock-step runs are the same twice; single nodes "
                    "can be replayed",
                    options.launch, graph.clock));
  }
  for (const auto& [name, value] : graph.args) plan.takes_log = plan.takes_log || name == "log";
  refuse_overwriting(graph, logs);
  plan.limit = run_limit(logs, graph.result ? graph.result->until.text : "");
  return plan;
}

ReplayReport replay_launch(const std::vector<OpenLog>& logs, const LaunchPlan& plan,
                           const ReplayOptions& options, const StopSignals& stop,
                           const ReplayProgress& progress) {
  return LaunchReplay(logs, plan, options).run(stop, progress);
}

}  // namespace mimesis::tool
