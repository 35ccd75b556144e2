#include "tools/mimesis/log/record.h"

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>

#include "common/error.h"
#include "common/runtime/raw.h"
#include "tools/mimesis/log/byte_size.h"
#include "tools/mimesis/log/counts_display.h"
#include "tools/mimesis/log/drain.h"
#include "tools/mimesis/log/record_head.h"
#include "tools/mimesis/log/record_output.h"
#include "tools/mimesis/log/record_report.h"
#include "tools/mimesis/log/silence_watch.h"
#include "tools/mimesis/log/snapshot_signal.h"
#include "tools/mimesis/log/tapped_message.h"
#include "tools/mimesis/stop_signals.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;
namespace fs = std::filesystem;

constexpr auto kPoll = 10ms;                     // how late a signal or a full chunk may be noticed
constexpr auto kLook = 100ms;                    // between looks at limits and counts
constexpr std::uint64_t kLookBytes = 1'000'000;  // received: the same
constexpr auto kLookForSilence = 500ms;

std::uint64_t wall_ns() {
  return static_cast<std::uint64_t>(
      std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count());
}

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

class Recorder {
 public:
  explicit Recorder(const RecordOptions& options);
  int run();

 private:
  log::Result receive();
  log::Result take();
  log::Result finish(log::Result so_far);
  void keep_house(WallTime now);
  void keep_limits();
  void watch_silence(WallTime now);
  void say(const std::string& line);
  int report(const std::string& error);

  const RecordOptions& options_;
  const StopSignals stop_;  // to the end: the file is to be closed
  SnapshotSignal snapshot_signal_;
  std::optional<runtime::Tap> tap_;
  std::optional<runtime::GraphView> graph_;
  std::uint64_t ready_ns_ = 0;  ///< who starts later waits for the recorder
  const WallTime start_ = steady_clock::now();
  const RecordHead head_;
  RecordOutput output_;
  Recording recording_;
  std::optional<Drain> drain_;
  CountsDisplay display_{std::cerr, start_};
  SilenceWatch silence_;
  std::chrono::nanoseconds graph_time_{0};  ///< the latest seen
  WallTime next_look_ = start_, next_look_for_silence_ = start_;
  std::uint64_t bytes_received_ = 0;  ///< since the last look
  std::string flaw_;                  ///< why it is not complete though its files are well
};

Recorder::Recorder(const RecordOptions& options)
    : options_(options),
      head_(options.attach,
            provenance(runtime::graph_name(), options.command, wall_ns(),
                       environment("MIMESIS_LAUNCH")),
            {.writer = {.library = "mimesis " MIMESIS_VERSION, .compression = options.compression},
             .sync = options.sync,
             .descriptors = [this](const std::string& type) { return tap_->descriptors(type); }}),
      output_(
          options.output, options.split, options.snapshot,
          [this](const std::string& path) { return head_.open(path); },
          [this](const std::string& line) { say(line); }),
      recording_([this](Recorded message, WallTime now) {
        return output_.write(std::move(message), now);
      }) {
  std::signal(SIGPIPE, SIG_IGN);  // whoever reads our lines may go away, the log is to be closed
  if (auto done = output_.start(); !done) throw ConfigError(done.error().reason);
  tap_.emplace(runtime::graph_name(), options.filter, runtime::Policy::reliable);
  graph_.emplace(runtime::graph_name());
  ready_ns_ = wall_ns();
}

int Recorder::run() {
  const log::Result done = finish(receive());
  return report(done ? flaw_ : done.error().reason);
}

/// Receives until stopped. The result is a failure to write.
log::Result Recorder::receive() {
  const auto ended = [&] {
    return options_.duration_s > 0.0 &&
           steady_clock::now() - start_ >= std::chrono::duration<double>(options_.duration_s);
  };
  while (!stop_.requested() && !ended() && flaw_.empty()) {
    if (auto done = take(); !done) return done;
    const auto now = steady_clock::now();
    if (snapshot_signal_.take()) {
      if (auto done = output_.trigger("SIGUSR1", now); !done) return done;
    }
    if (now >= next_look_ || bytes_received_ > kLookBytes) keep_house(now);
  }
  display_.clear();
  drain_.emplace(steady_clock::now(), wall_ns());
  while (flaw_.empty() && !drain_->over(steady_clock::now())) {
    if (auto done = take(); !done) return done;
  }
  if (flaw_.empty() && drain_->gave_up(steady_clock::now())) {
    flaw_ = fmt::format(
        "messages from before the end still came {} s after it: the last ones may be missing",
        Drain::kAtMost.count());
  }
  return {};
}

/// Takes a message if one comes soon, and writes what is due.
log::Result Recorder::take() {
  auto tapped = tap_->next(kPoll);
  const auto now = steady_clock::now();
  if (tapped) {
    const bool from_first =
        tapped->publisher != nullptr && tapped->publisher->started_ns() > ready_ns_;
    Recorded message = recorded(*std::move(tapped), wall_ns());
    bytes_received_ += message.payload.size();
    if (message.ordered) {
      graph_time_ = std::max(graph_time_, std::chrono::nanoseconds(message.log_time_ns));
    }
    if (drain_) {
      drain_->received(now, message.ordered,
                       message.ordered ? message.log_time_ns : message.publish_time_ns);
    }
    if (auto done = recording_.add(std::move(message), now, from_first); !done) return done;
  }
  if (auto done = recording_.advance(now); !done) return done;
  return output_.advance(now);
}

log::Result Recorder::finish(log::Result so_far) {
  const auto now = steady_clock::now();
  if (so_far) so_far = recording_.finish(now);
  // After a failure, too: the file that failed stays as it is, another one is to be closed well.
  const auto done = output_.finish(now);
  if (so_far) so_far = done;
  if (!so_far) {
    for (const std::string& path : output_.files().paths()) remove_if_empty(path);
  }
  return so_far;
}

void Recorder::keep_house(WallTime now) {
  next_look_ = now + kLook;
  bytes_received_ = 0;
  if (options_.limits.any()) keep_limits();
  if (now >= next_look_for_silence_) watch_silence(now);
  if (options_.quiet) return;
  const OwnFiles& files = output_.files();
  display_.show({.counts = recording_.counts(),
                 .file = output_.activity(),
                 .bytes = files.total(),
                 .free_bytes = disk_space(options_.output).free},
                terminal_size(), now);
}

void Recorder::keep_limits() {
  const DiskLimits& limits = options_.limits;
  for (;;) {
    OwnFiles& files = output_.files();
    const std::string reached = reached_limit(limits, files.total(), disk_space(options_.output));
    if (reached.empty()) return;
    const std::string oldest = limits.delete_oldest ? files.take_oldest() : "";
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

void Recorder::watch_silence(WallTime now) {
  next_look_for_silence_ = now + kLookForSilence;
  const SilenceWatch::Now times{now.time_since_epoch(), graph_time_};
  for (const v1::NodeInfo& node : graph_->nodes()) {
    if (!node.ready()) continue;
    for (const v1::TopicInfo& output : node.outputs()) {
      if (!options_.filter(output.topic())) continue;
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

void Recorder::say(const std::string& line) {
  display_.clear();
  std::cerr << line << std::endl;
}

int Recorder::report(const std::string& error) {
  const Counts& counts = recording_.counts();
  OwnFiles& files = output_.files();
  const RecordResult result{options_.output,    counts,        files.paths(),
                            output_.messages(), files.total(), error};
  if (options_.json) {
    print_json(result);
  } else if (!options_.quiet) {
    print_table(result);
  }
  if (!error.empty()) say("recording stopped: " + error);
  for (const std::string& topic : options_.filter.topics()) {
    const bool seen =
        std::ranges::any_of(counts.topics, [&](const auto& c) { return c.first.first == topic; });
    if (!seen) say(fmt::format("topic {}: not one message", topic));
  }
  std::string what = options_.output;
  if (options_.snapshot.on()) what = fmt::format("{} snapshots", result.files.size());
  if (options_.split.on())
    what = fmt::format("{} files up to {}", result.files.size(), files.last());
  say(fmt::format("{}: {} messages, {} lost, {}", what, result.messages, counts.total.lost,
                  bytes_text(result.bytes)));
  if (counts.total.received == 0) say("nothing was recorded: no message came");
  return error.empty() && counts.total.lost == 0 && counts.total.received > 0 ? 0 : 1;
}

}  // namespace

int log_record(const RecordOptions& options) {
  std::error_code ignored;  // whoever creates the file says what is wrong
  fs::create_directories(fs::path(options.output).parent_path(), ignored);
  if (options.split.on()) refuse_older_parts(options.output);
  return Recorder(options).run();
}

}  // namespace mimesis::tool
