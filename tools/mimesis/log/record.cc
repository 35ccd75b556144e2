// `mimesis log record`: records the graph until SIGINT, SIGTERM or SIGHUP.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/error.h"
#include "common/json_text.h"
#include "common/log/codec.h"
#include "common/log/summary.h"
#include "common/runtime/graph_time.h"
#include "common/runtime/own_topics.h"
#include "common/runtime/raw.h"
#include "common/runtime/value_text.h"
#include "common/runtime/yaml_document.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/log/record_file.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/stop_signals.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/topic_filter.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
namespace fs = std::filesystem;

struct RecordOptions {
  bool all = false;
  std::vector<std::string> topics;
  std::string regex, exclude, output;
  std::string compression = "zstd";
  double duration_s = 0.0;          ///< duration in wall time; 0: until stopped
  double timeout_s = 0.0;           ///< longest wait for the first message; 0: any
  std::vector<std::string> attach;  ///< files that are stored in the log
  SplitOptions split;
  DiskLimits limits;
  std::string when_full = "stop";
  std::vector<std::string> elided;   ///< TOPIC:KEY=VALUE
  std::chrono::nanoseconds sync{0};  ///< period of fsync; 0: never
  bool quiet = false;                ///< no live counts
  bool json = false;
};

Provenance own_provenance() {
  std::ifstream in("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; std::getline(in, word, '\0');) words.push_back(word);
  const char* launch = std::getenv("MIMESIS_LAUNCH");
  const std::chrono::nanoseconds started = std::chrono::system_clock::now().time_since_epoch();
  return provenance(runtime::graph_name(), words, static_cast<std::uint64_t>(started.count()),
                    launch != nullptr ? launch : "");
}

/// A tapped message as it goes into a log. Its log time: on a simulated clock the graph's, so that
/// equal runs give equal logs; else its receipt, `now_ns`.
Recorded recorded(runtime::Tapped tapped, std::uint64_t now_ns) {
  Recorded m;
  m.topic = std::move(tapped.topic);
  m.type = std::move(tapped.type);
  m.type_hash = tapped.type_hash;
  m.node = std::move(tapped.message.source);
  m.start_id = tapped.message.start_id;
  m.seq = tapped.message.seq;
  m.payload = std::move(tapped.message.payload);
  m.publish_time_ns = static_cast<std::uint64_t>(tapped.message.stamp.count());
  if (tapped.publisher != nullptr) {
    m.clock = tapped.publisher->clock();
    // The clock node itself steps on the wall clock, but its messages have graph time.
    m.ordered = m.clock == "sim" || m.clock == "lockstep" ||
                m.type == v1::ClockTime::descriptor()->full_name();
    for (const auto& output : tapped.publisher->outputs()) {
      if (output.topic() == m.topic) m.latched = output.latched();
    }
  }
  if (tapped.tick.count() > 0) {
    m.log_time_ns = static_cast<std::uint64_t>(tapped.tick.count());
  } else {
    m.log_time_ns = m.ordered ? m.publish_time_ns : now_ns;
  }
  return m;
}

/// Topics whose payloads are elided, and when: a node whose parameters do not show that it
/// can compute its messages again keeps them whole.
class ElidedTopics {
 public:
  /// "TOPIC:KEY=VALUE". @throws ConfigError
  explicit ElidedTopics(const std::vector<std::string>& options) {
    for (const std::string& text : options) {
      const std::size_t colon = text.find(':'), equals = text.find('=', colon + 1);
      if (colon == std::string::npos || equals == std::string::npos)
        throw ConfigError("--elide '" + text + "': expected TOPIC:KEY=VALUE");
      wanted_[text.substr(0, colon)] = {text.substr(colon + 1, equals - colon - 1),
                                        text.substr(equals + 1)};
    }
  }

  void apply(Recorded& message) {
    if (wanted_.empty()) return;
    if (runtime::is_own_topic(message.topic, runtime::kStartPort)) return read(message);
    const auto wanted = wanted_.find(message.topic);
    if (wanted == wanted_.end()) return;
    const auto parameters = parameters_.find({message.node, message.start_id});
    if (parameters == parameters_.end()) return;
    const runtime::Yaml* value = parameters->second.find(wanted->second.key);
    if (value == nullptr || value->text != wanted->second.value) return;
    message.payload = elide(message.payload);
    message.elided = true;
  }

 private:
  struct Condition {
    std::string key, value;
  };
  /// A node says its parameters before its first message.
  void read(const Recorded& message) {
    v1::NodeStart start;
    if (start.ParseFromString(message.payload)) {
      parameters_[{start.node(), start.start_id()}] =
          runtime::parse_yaml(start.parameters(), message.topic);
    }
  }

  std::map<std::string, Condition> wanted_;  ///< by topic
  std::map<std::pair<std::string, std::uint64_t>, runtime::Yaml> parameters_;
};

/// What stands in the files of a recording that failed.
struct Standing {
  std::uint64_t messages = 0, bytes = 0;
};
Standing standing_in(const std::vector<std::string>& paths) {
  Standing standing;
  for (const std::string& path : paths) {
    const auto source = log::open_file(path);
    if (!source) continue;
    standing.bytes += (*source)->size();
    const auto summary = log::summarize(**source);
    if (summary) standing.messages += summary->statistics.message_count;
  }
  return standing;
}

class Recorder {
 public:
  /// @throws ConfigError before the first message
  explicit Recorder(const RecordOptions& options)
      : options_(options),
        filter_(options.topics, options.regex, options.exclude),
        elided_(options.elided),
        output_(open_output()),
        recording_(
            [this](Recorded message, WallTime now) { output_.write(std::move(message), now); }) {
    std::signal(SIGPIPE, SIG_IGN);  // the reader of our lines may go away, the log is to be closed
    std::signal(SIGXFSZ, SIG_IGN);  // a limit of file sizes is met as a full disk is
    tap_.emplace(runtime::graph_name(), filter_, runtime::Policy::reliable);
    graph_.emplace(runtime::graph_name());
    ready_ns_ = now_ns();
  }

  /// Returns the exit code: 0 if something was recorded and nothing was lost, else 1.
  int run() {
    std::string failure;
    const auto attempt = [&failure](const auto& write) {
      try {
        write();
      } catch (const WriteFailure& e) {
        if (failure.empty()) failure = e.what();
      }
    };
    attempt([this] { receive(); });
    const auto now = steady_clock::now();
    if (failure.empty()) attempt([&] { recording_.finish(now); });
    // After a failure, too: the file that failed stays as it is, another one is to be closed well.
    attempt([&] { output_.finish(now); });
    if (failure.empty()) return report(flaw_);
    for (const std::string& path : output_.files().paths()) remove_if_empty(path);
    return report(failure, standing_in(output_.files().paths()));
  }

 private:
  static constexpr auto kPoll = 10ms;   // how late a signal or a full chunk may be noticed
  static constexpr auto kLook = 100ms;  // between looks at limits and counts
  static constexpr std::uint64_t kLookBytes = 1'000'000;  // received: the same
  static constexpr auto kLookForSilence = 500ms;

  SplitLog open_output() {
    const auto open = with_head(
        options_.attach, own_provenance(),
        {.writer = {.library = "mimesis " MIMESIS_VERSION,
                    .compression = *log::parse_compression(options_.compression)},
         .descriptors = [this](std::uint64_t type_hash) { return tap_->descriptors(type_hash); },
         .sync = options_.sync});
    try {
      return SplitLog(options_.output, options_.split, open);
    } catch (const WriteFailure& e) {
      throw ConfigError(e.what());
    }
  }

  /// Receives until stopped. @throws WriteFailure
  void receive() {
    const auto ended = [&] {
      const double passed_s = std::chrono::duration<double>(steady_clock::now() - start_).count();
      const bool any = recording_.counts().total.received > 0;
      timed_out_ = !any && options_.timeout_s > 0.0 && passed_s > options_.timeout_s;
      return timed_out_ || (options_.duration_s > 0.0 && passed_s >= options_.duration_s);
    };
    while (!stop_.requested() && !ended() && flaw_.empty()) {
      take();
      const auto now = steady_clock::now();
      if (now >= next_look_ || bytes_received_ > kLookBytes) keep_house(now);
    }
    line_.clear();
    drain_.emplace(steady_clock::now(), now_ns());
    while (flaw_.empty() && !drain_->over(steady_clock::now())) take();
    if (flaw_.empty() && drain_->gave_up(steady_clock::now())) {
      flaw_ = fmt::format(
          "messages from before the end still came {} s after it: the last ones may be missing",
          Drain::kAtMost.count());
    }
  }

  /// Takes a message if one comes soon, and writes data that is due.
  void take() {
    auto tapped = tap_->next(kPoll);
    const auto now = steady_clock::now();
    if (tapped) {
      const bool from_first =
          tapped->publisher != nullptr && tapped->publisher->started_ns() > ready_ns_;
      Recorded message = recorded(*std::move(tapped), now_ns());
      bytes_received_ += message.payload.size();
      elided_.apply(message);
      if (message.ordered) {
        graph_time_ = std::max(graph_time_, std::chrono::nanoseconds(message.log_time_ns));
      }
      if (drain_) {
        drain_->received(now, message.ordered,
                         message.ordered ? message.log_time_ns : message.publish_time_ns);
      }
      recording_.add(std::move(message), now, from_first);
    }
    recording_.advance(now);
    output_.advance(now);
  }

  std::uint64_t now_ns() const { return static_cast<std::uint64_t>(time_.now().count()); }

  void keep_house(WallTime now) {
    next_look_ = now + kLook;
    bytes_received_ = 0;
    if (options_.limits.any()) keep_limits();
    if (now >= next_look_for_silence_) watch_silence(now);
    if (options_.quiet) return;
    line_.show({.counts = recording_.counts(),
                .file = output_.place(),
                .bytes = output_.files().total(),
                .free_bytes = disk_space(options_.output).available},
               now);
  }

  void keep_limits() {
    for (;;) {
      const std::string reached =
          reached_limit(options_.limits, output_.files().total(), disk_space(options_.output));
      if (reached.empty()) return;
      const std::string oldest = options_.limits.delete_oldest ? output_.files().take_oldest() : "";
      if (oldest.empty()) {
        flaw_ = reached;
        return;
      }
      std::error_code error;
      fs::remove(oldest, error);
      say(error ? fmt::format("cannot delete '{}': {}", oldest, error.message())
                : fmt::format("deleted '{}': {}", oldest, reached));
    }
  }

  void watch_silence(WallTime now) {
    next_look_for_silence_ = now + kLookForSilence;
    const SilenceWatch::Now times{now.time_since_epoch(), graph_time_};
    for (const v1::NodeInfo& node : graph_->nodes()) {
      if (!node.ready()) continue;
      for (const v1::TopicInfo& output : node.outputs()) {
        if (!filter_(output.topic())) continue;
        const bool graph_time =
            node.clock() != "wall" || output.type() == v1::ClockTime::descriptor()->full_name();
        silence_.met(output.topic(), node.name(), graph_time, times);
      }
    }
    const std::vector<std::string> silent = silence_.silent(recording_.counts(), times);
    if (!silent.empty()) {
      say(fmt::format("no message for {} s although there is a publisher: {}",
                      SilenceWatch::kPatience.count(), fmt::join(silent, ", ")));
    }
  }

  void say(const std::string& line) {
    line_.clear();
    std::cerr << printable(line) << std::endl;
  }

  /// `standing`: in the files, if not all that was written.
  int report(const std::string& error, std::optional<Standing> standing = {}) {
    const Counts& counts = recording_.counts();
    const std::vector<std::string> paths = output_.files().paths();
    if (!standing) {
      standing = {output_.messages(), output_.files().total()};
    }
    const auto [messages, bytes] = *standing;
    TextTable table({"TOPIC", "NODE", "RECEIVED", "LOST"});
    auto topics = nlohmann::ordered_json::array();
    for (const auto& [key, count] : counts.topics) {
      const auto& [topic, node] = key;
      table.row({topic, node, std::to_string(count.received), std::to_string(count.lost)});
      topics.push_back(
          {{"topic", topic}, {"node", node}, {"received", count.received}, {"lost", count.lost}});
    }
    if (options_.json) {
      const nlohmann::ordered_json all{{"file", options_.output}, {"files", paths},
                                       {"messages", messages},    {"lost", counts.total.lost},
                                       {"bytes", bytes},          {"error", error},
                                       {"topics", topics}};
      std::cout << json_text(all) << std::endl;
    } else if (!options_.quiet) {
      table.print(std::cerr, use_colour(2));
    }
    for (const std::string& topic : filter_.topics()) {
      const bool seen =
          std::ranges::any_of(counts.topics, [&](const auto& c) { return c.first.first == topic; });
      if (!seen) say(fmt::format("topic {}: not one message", topic));
    }
    std::string what = options_.output;
    if (options_.split.on())
      what = fmt::format("{} files up to {}", paths.size(), output_.files().last());
    say(fmt::format("{}: {} messages, {} lost, {}", what, messages, counts.total.lost,
                    bytes_text(bytes)));
    if (counts.total.received == 0) say("nothing was recorded: no message came");
    if (timed_out_) return 3;
    // The last line: a launcher gives it as the reason.
    if (!error.empty()) say("recording stopped: " + error);
    return error.empty() && counts.total.lost == 0 && counts.total.received > 0 ? 0 : 1;
  }

  const RecordOptions& options_;
  const TopicFilter filter_;
  ElidedTopics elided_;
  const StopSignals stop_;  // to the end: the file is to be closed
  runtime::GraphTime time_{runtime::graph_directory(runtime::graph_name())};
  std::optional<runtime::Tap> tap_;
  std::optional<runtime::GraphView> graph_;
  std::uint64_t ready_ns_ = 0;  ///< nodes that start later wait for the recorder
  const WallTime start_ = steady_clock::now();
  SplitLog output_;
  Recording recording_;
  std::optional<Drain> drain_;
  CountsLine line_{start_};
  SilenceWatch silence_;
  std::chrono::nanoseconds graph_time_{0};  ///< the latest seen
  WallTime next_look_ = start_, next_look_for_silence_ = start_;
  std::uint64_t bytes_received_ = 0;  ///< since the last look
  bool timed_out_ = false;            ///< no message came in time
  std::string flaw_;                  ///< why it is not complete though its files are well
};

/// Refuses parts of an earlier recording, which would be taken for parts of this one.
void refuse_older_parts(const std::string& output) {
  const fs::path path(output);
  const std::string stem = path.stem().string() + "_";
  std::error_code ignored;  // no folder, no parts
  for (const auto& entry : fs::directory_iterator(
           path.has_parent_path() ? path.parent_path() : fs::path("."), ignored)) {
    const std::string name = entry.path().stem().string();
    if (entry.path().extension() != path.extension() || !name.starts_with(stem)) continue;
    constexpr std::size_t kDigits = 3;
    if (name.size() >= stem.size() + kDigits &&
        name.find_first_not_of("0123456789", stem.size()) == std::string::npos) {
      throw ConfigError(fmt::format(
          "'{}' is there from an earlier recording: remove its files, or choose another --output",
          entry.path().string()));
    }
  }
}

/// For CLI::Option::check: the error, or empty.
std::string size_check(const std::string& text) {
  const auto bytes = to_bytes(text);
  return bytes && *bytes > 0 ? "" : "expected a size such as 500MB or 2GiB, found '" + text + "'";
}

std::string duration_check(const std::string& text) {
  const auto duration = runtime::to_duration(text);
  return duration && duration->count() > 0
             ? ""
             : "expected a duration such as 500ms, 30s or 10min, found '" + text + "'";
}

std::optional<double> to_percent(const std::string& text) {
  if (!text.ends_with('%')) return std::nullopt;
  const auto percent = runtime::to_double(text.substr(0, text.size() - 1));
  return percent && *percent > 0.0 && *percent < 100.0 ? percent : std::nullopt;
}

std::string free_check(const std::string& text) {
  return to_percent(text) || size_check(text).empty()
             ? ""
             : "expected a size such as 2GB or a percentage such as 5%, found '" + text + "'";
}

CLI::Option* add_size(CLI::App& app, const char* name, std::uint64_t& bytes, const char* help) {
  return app
      .add_option_function<std::string>(
          name, [&bytes](const std::string& text) { bytes = *to_bytes(text); }, help)
      ->check(size_check);
}

CLI::Option* add_duration(CLI::App& app, const char* name, std::chrono::nanoseconds& duration,
                          const char* help) {
  return app
      .add_option_function<std::string>(
          name, [&duration](const std::string& text) { duration = *runtime::to_duration(text); },
          help)
      ->check(duration_check);
}

/// @throws ConfigError if the options contradict each other
void check_options(const RecordOptions& o) {
  const auto refuse = [](const std::string& why) {
    throw ConfigError("mimesis log record: " + why);
  };
  const bool chosen = !o.topics.empty() || !o.regex.empty();
  if (!o.all && !chosen) refuse("say what: --all, --topic NAME or --regex RE");
  if (o.all && chosen) refuse("--all leaves nothing for --topic and --regex to choose");
  if (!o.limits.delete_oldest) return;
  if (!o.limits.any() || !o.split.on()) {
    refuse(
        "--when-full delete-oldest needs a limit (--max-size or --min-free) and several files "
        "(--split-size or --split-duration)");
  }
  if (o.limits.max_size > 0 && o.split.size >= o.limits.max_size) {
    refuse("--split-size must be less than --max-size, or the oldest file is the only one");
  }
}

void add_recorded(CLI::App& record, RecordOptions& o) {
  record.add_flag("--all", o.all, "All topics");
  record.add_option("--topic", o.topics, "This topic (repeatable)")->allow_extra_args(false);
  record.add_option("--regex", o.regex, "Topics that match as a whole");
  record.add_option("--exclude", o.exclude, "Exclude topics that match as a whole");
  record.add_option("--output,-o", o.output, "File to write; replaced if it exists")->required();
  record.add_option("--compression", o.compression, "Compression of chunks")
      ->check(CLI::IsMember({"zstd", "lz4", "none"}))
      ->capture_default_str();
  record
      .add_option("--timeout", o.timeout_s,
                  "Longest wait for the first message [s]; then exit code 3")
      ->check(number_above_zero);
  record.add_option("--duration", o.duration_s, "Stop after this wall time [s]")
      ->check(number_above_zero);
  record.add_option("--attach", o.attach, "Store this file in the log (repeatable)")
      ->allow_extra_args(false);
  record
      .add_option("--elide", o.elided,
                  "Store messages of TOPIC without their large fields if KEY of their node's "
                  "parameters is VALUE, by which it can compute them again: mimesis log restore "
                  "(repeatable)")
      ->type_name("TOPIC:KEY=VALUE")
      ->allow_extra_args(false);
  add_duration(record, "--sync", o.sync,
               "Period of syncing the file to the disk, against power cuts (default: never)");
  record.add_flag("--quiet", o.quiet, "No counts while recording, no table at the end");
  record.add_flag("--json", o.json, "Print the counts as one JSON object at the end");
}

void add_files(CLI::App& record, RecordOptions& o) {
  constexpr auto kSplit = "Several files (run.mcap: run_000.mcap, run_001.mcap, ...)";
  add_size(record, "--split-size", o.split.size, "No file becomes larger than this")->group(kSplit);
  add_duration(record, "--split-duration", o.split.duration, "Start a new file after this log time")
      ->group(kSplit);

  constexpr auto kLimits = "Limits of the disk";
  add_size(record, "--max-size", o.limits.max_size, "Size of all files of the recording")
      ->group(kLimits);
  record
      .add_option_function<std::string>(
          "--min-free",
          [&o](const std::string& text) {
            const auto percent = to_percent(text);
            o.limits.min_free_percent = percent.value_or(0.0);
            o.limits.min_free = percent ? 0 : *to_bytes(text);
          },
          "Free space to leave on the disk: a size or a percentage")
      ->check(free_check)
      ->group(kLimits);
  record
      .add_option("--when-full", o.when_full,
                  "Close the log and stop, or delete the recording's own oldest file")
      ->check(CLI::IsMember({"stop", "delete-oldest"}))
      ->capture_default_str()
      ->group(kLimits);
}

}  // namespace

void add_record(CLI::App& log, int& exit_code) {
  CLI::App* record =
      log.add_subcommand("record", "Records topics of the graph until it is stopped");
  auto o = std::make_shared<RecordOptions>();
  add_recorded(*record, *o);
  add_files(*record, *o);
  record->footer(
      "Nodes that start after the recorder wait for it: their first message is in the log.\n"
      "SIGINT, SIGTERM and SIGHUP close the log; after kill -9 it opens, too, less the last 100 "
      "ms.\n"
      "Exit code 1 if a message was lost or could not be written, a limit was reached, or no "
      "message came.\n"
      "A new log can be read by its owner alone (mode 0600); two recorders cannot write one file.\n"
      "Examples:\n"
      "  mimesis log record --all --exclude '.*/health' -o run.mcap\n"
      "  mimesis log record --all -o run.mcap --split-size 1GB --max-size 20GB --when-full "
      "delete-oldest");
  record->callback([o, &exit_code] {
    o->limits.delete_oldest = o->when_full == "delete-oldest";
    check_options(*o);
    std::error_code ignored;  // opening the file reports the error
    fs::create_directories(fs::path(o->output).parent_path(), ignored);
    if (o->split.on()) refuse_older_parts(o->output);
    exit_code = Recorder(*o).run();
  });
}

}  // namespace mimesis::tool
