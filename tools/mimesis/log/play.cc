// `mimesis log play`: publishes the messages of a log on their topics with their types, latched
// ones first; on the wall clock at a rate, or as a member of a lock-step graph.
#include <fmt/format.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "common/json_text.h"
#include "common/runtime/log.h"
#include "common/runtime/ports.h"
#include "common/runtime/raw.h"
#include "common/runtime/service_manager.h"
#include "common/runtime/zmq_bus.h"
#include "proto/player.pb.h"
#include "proto/runtime.pb.h"
#include "tools/mimesis/graph_tools.h"
#include "tools/mimesis/launch/process.h"
#include "tools/mimesis/log/play_curves.h"
#include "tools/mimesis/log/play_parts.h"
#include "tools/mimesis/log/play_restore.h"
#include "tools/mimesis/log/playback.h"
#include "tools/mimesis/log/restore.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using runtime::Time;
using runtime::to_seconds;

struct PlayOptions {
  std::vector<std::string> files;
  TopicOptions topics;
  std::vector<std::string> remaps;
  PlaybackOptions playback;  ///< options of the player
  PlayAheadLimits ahead;
  std::string name;  ///< in the graph; empty: as the launch file says, else "player"
  std::vector<std::string> into_live;  ///< topics
  double rate = 1.0;                   ///< recorded seconds per second of wall time [1]
  int loops = 1;                       ///< 0: until stopped
  bool paused = false;                 ///< at the start
  bool stay = false;                   ///< at the end: paused, or a silent member of the lock-step
  bool as_recorded = false;            ///< elided payloads are not computed again
  bool restore_all = false;            ///< also those that nobody looks at
  bool clock = false;                  ///< also drive the graph's simulated clock
  bool lockstep = false;               ///< take part in a lock-step graph
  bool json = false;
};

constexpr double kSlowestPlay = 1e-3, kFastestPlay = 1e3;  // bounds of the rate [1]

/// Plays on the wall clock; steered by services (proto/player.proto) and signals. Late or
/// slow subscribers do not change the played messages: the player waits for reliable ones, and
/// recorded time stands meanwhile.
class PacedPlayer {
 public:
  PacedPlayer(const PlayOptions& options, Playback& playback, const LivePublishing& wish)
      : options_(options),
        playback_(playback),
        ahead_(playback, options.ahead, [this] { ring(); }),
        bus_(PlayOutput::bus_options(wish, options.clock)),
        output_(bus_, playback.topics(), options.clock, options.playback.last_of_all),
        timeline_(options.rate),
        paused_(options.paused),
        marks_(playback),
        curves_(playback) {
    constexpr unsigned long kTimerSlack_ns = 1000;  // how late the kernel may wake us
    MIMESIS_ASSERT(bell_.open());
    ahead_.set_rate(options.rate);
    serve_requests();
    prctl(PR_SET_TIMERSLACK, kTimerSlack_ns);
    if (options.playback.last_of_all && !options.as_recorded)
      restorer_.emplace(playback, [this] { ring(); });
    jump(playback.start_ns());  // requests are answered from now on
    bus_.ready();
  }

  /// Plays until the end or a signal; returns the exit code.
  int run() {
    // No subscriber that is there already shall miss the first messages.
    for (const auto give_up = now() + kConnect;
         running() && output_.awaits_subscribers() && now() < give_up;) {
      wait_until(now() + kLook);
    }
    for (const auto give_up = now() + kReadAheadAtFirst;
         running() && !ahead_.full() && now() < give_up;) {
      wait_until(give_up);
    }
    holding_ = false;
    do {
      play_pass();
    } while (running() && next_pass());
    halt();
    tell_clock();  // it stands, for nodes that are still there
    line_.clear();
    empty_backlog();
    return report();
  }

 private:
  using Wall = PlayTimeline::Wall;
  /// Why a request is not followed.
  struct Refusal {
    std::string why;
  };

  static constexpr auto kConnect = 5s;  // for nodes that subscribe already
  static constexpr auto kLook = 20ms;
  static constexpr auto kReadAheadAtFirst = 250ms;
  static constexpr auto kStuck = 5s;  // without a message taken, a subscriber is given up
  static Wall now() { return std::chrono::steady_clock::now(); }

  bool running() const { return !stop_signal_.requested(); }

  bool next_pass() {
    if (options_.loops > 0 && pass_ >= options_.loops) return false;
    ++pass_;
    jump(playback_.start_ns());
    return true;
  }

  void play_pass() {
    if (!paused_) go();
    while (running()) {
      const Played* next = ahead_.front();
      if (next == nullptr && ahead_.ended()) {
        step_to_.reset();
        if (!paused_ && !options_.stay) return;
        if (!paused_) pause();
        wait_for(nullptr);
      } else if (next != nullptr &&
                 (step_to_ || (!paused_ && timeline_.due(play_time(next->log_time_ns)) <= now()))) {
        play(*next);
        breathe();
      } else {
        wait_for(next);
      }
    }
  }

  void play(const Played& message) {
    const Time log_time = play_time(message.log_time_ns);
    const std::size_t size = message.payload.size();
    const std::string& topic = message.topic->topic;
    if (paused_) {
      timeline_.jump(now(), log_time);
      tell_clock();
      send(message);
      if (step_to_ && (step_to_->empty() || *step_to_ == topic)) step_to_.reset();
    } else {
      send(message);
      lateness_.add(now() - timeline_.due(log_time));
    }
    last_topic_ = topic;
    ahead_.pop();
    ++messages_;
    ++unserved_;
    unserved_bytes_ += size;
  }

  /// As it was sent, if it is elided and that has been computed.
  void send(const Played& message) {
    auto whole = restorer_ ? restorer_->whole(message) : std::nullopt;
    if (!whole) return output_.send(message);
    output_.send({message.topic, message.log_time_ns, message.publish_time_ns, std::move(*whole)});
  }

  /// What was elided and is looked at comes when it has been computed.
  void restore() {
    std::set<std::string> looked_at;
    for (const PlayedTopic& topic : playback_.topics()) {
      if (restorer_->elided(topic.topic) &&
          (options_.restore_all || output_.has_subscribers(topic)))
        looked_at.insert(topic.topic);
    }
    restorer_->look_at(std::move(looked_at), position_ns());
    for (const Played& message : restorer_->fresh()) output_.send(message);
    next_restore_ = now() + kLook;
  }

  /// Serves the bus between two messages, even if they leave no time to wait.
  void breathe() {
    constexpr std::uint64_t kServeMessages = 64, kServeBytes = 1 << 20;
    if (unserved_ >= kServeMessages || unserved_bytes_ >= kServeBytes) wait_until(now());
    hold_for_slow();
  }

  /// Loses nothing at reliable subscribers that are slower than the log: recorded time stands until
  /// they have caught up by half.
  void hold_for_slow() {
    // Half of the messages that the bus keeps for slow reliable subscribers before they miss some.
    constexpr std::uint64_t kBacklogMessages = 50'000, kBacklogBytes = 64 << 20;
    const auto behind = [this](std::uint64_t share) {
      return bus_.backlog() > kBacklogMessages / share ||
             bus_.backlog_bytes() > kBacklogBytes / share;
    };
    if (bus_.backlog() == 0) given_up_ = false;
    if (given_up_ || !behind(1)) return;
    const auto begin = now();
    holding_ = true;
    halt();
    tell_clock();
    given_up_ = !await_backlog(1ms, [&] { return behind(2); });
    if (given_up_) {
      line_.clear();
      std::cerr << fmt::format("{}: a reliable subscriber takes nothing and is not waited for\n",
                               options_.name);
    }
    holding_ = false;
    held_ += now() - begin;
    if (!paused_) go();
  }

  /// Waits while `more()`, as long as subscribers take something; false if they do not for kStuck.
  bool await_backlog(Time turn, const auto& more) {
    auto give_up = now() + kStuck;
    for (std::uint64_t least = bus_.backlog(); running() && more(); wait_until(now() + turn)) {
      if (bus_.backlog() < least) give_up = now() + kStuck;
      least = std::min(least, bus_.backlog());
      if (now() >= give_up) return false;
    }
    return true;
  }

  /// Lets the last messages leave this process.
  void empty_backlog() {
    const auto end = now() + 200ms;
    await_backlog(kLook, [&] { return now() < end || bus_.backlog() > 0; });
  }

  /// Waits until `next` is due or something else is to be done.
  void wait_for(const Played* next) {
    auto until = now() + 1h;
    if (next != nullptr && timeline_.running()) {
      until = std::min(until, timeline_.due(play_time(next->log_time_ns)));
    }
    wait_until(until);
  }

  void wait_until(Wall until) {
    if (output_.clock()) until = std::min(until, next_clock_);
    if (restorer_) until = std::min(until, next_restore_);
    if (on_terminal_) until = std::min(until, now() + StatusLine::kInPlace);
    const std::array<int, 2> fds{stop_signal_.fd(), bell_.get()};
    unserved_ = unserved_bytes_ = 0;
    const auto left = std::max<Wall::duration>(until - now(), 0ns);
    if (bus_.wait(std::chrono::steady_clock::now() + left, fds)) {
      eventfd_t count = 0;
      [[maybe_unused]] const auto rang = eventfd_read(bell_.get(), &count);
    }
    if (output_.clock() && now() >= next_clock_) tell_clock();
    if (restorer_ && now() >= next_restore_) restore();
    if (!on_terminal_) return;
    line_.show(fmt::format("{:.1f} / {:.1f} s  x{:.3g}{}{}", playback_.position_s(position_ns()),
                           playback_.position_s(playback_.end_ns()), timeline_.rate(),
                           paused_ ? "  PAUSED" : "", holding_ ? "  waits for subscribers" : ""),
               now());
  }

  /// Ends `wait_until`; from any thread.
  void ring() { [[maybe_unused]] const auto done = eventfd_write(bell_.get(), 1); }

  void go() {
    if (holding_ || timeline_.running()) return;
    going_since_ = now();
    timeline_.run(going_since_);
    tell_clock();
  }

  void halt() {
    if (!timeline_.running()) return;
    going_ += now() - going_since_;
    const Time end = play_time(playback_.end_ns());
    timeline_.stand(now());
    if (timeline_.at(now()) > end) timeline_.jump(now(), end);
  }

  void jump(std::uint64_t log_time_ns) {
    step_to_.reset();
    const std::vector<Played> latched = ahead_.seek(log_time_ns);
    timeline_.jump(now(), play_time(log_time_ns));
    tell_clock();
    for (const Played& value : latched) send(value);
    if (restorer_) restore();
  }

  void tell_clock() {
    next_clock_ = now() + 50ms;
    output_.tell_clock(play_time(position_ns()), timeline_.running() ? timeline_.rate() : 0.0);
  }

  std::uint64_t position_ns() const {
    return std::clamp(static_cast<std::uint64_t>(timeline_.at(now()).count()), playback_.start_ns(),
                      playback_.end_ns());
  }

  // Requests of services. All may throw a Refusal.

  void pause() {
    paused_ = true;
    halt();
    tell_clock();
  }

  void resume() {
    paused_ = false;
    step_to_.reset();
    go();
  }

  /// Pauses and plays one message, or all up to the next one of `topic`.
  void step(const std::string& topic) {
    const auto& topics = playback_.topics();
    if (!topic.empty() && std::ranges::find(topics, topic, &PlayedTopic::topic) == topics.end()) {
      throw Refusal{fmt::format("topic {} is not played", topic)};
    }
    pause();
    while (ahead_.front() == nullptr && !ahead_.ended()) std::this_thread::sleep_for(100us);
    if (ahead_.ended()) throw Refusal{"the log is at its end"};
    step_to_ = topic;
    if (topic.empty() && !holding_) play(*ahead_.front());  // here: the answer tells of it
  }

  void seek(const v1::PlayerSeek& request) {
    switch (request.target_case()) {
      case v1::PlayerSeek::kPositionS:
        if (!std::isfinite(request.position_s())) throw Refusal{"position_s is not a number"};
        if (request.position_s() < 0.0) throw Refusal{"position_s is below 0"};
        return seek(playback_.log_time_ns(request.position_s()));
      case v1::PlayerSeek::kOffsetS:
        return seek_by(request.offset_s());
      case v1::PlayerSeek::kLogTimeNs:
        return seek(request.log_time_ns());
      case v1::PlayerSeek::TARGET_NOT_SET:
        throw Refusal{"say where: position_s, offset_s or log_time_ns"};
    }
  }

  void seek(std::uint64_t log_time_ns) {
    const auto position_s = [this](std::uint64_t ns) { return playback_.position_s(ns); };
    if (log_time_ns < playback_.start_ns() || log_time_ns > playback_.end_ns()) {
      throw Refusal{fmt::format("{:.9f} s is outside of what is played: {:.9f} to {:.9f} s",
                                position_s(log_time_ns), position_s(playback_.start_ns()),
                                position_s(playback_.end_ns()))};
    }
    jump(log_time_ns);
  }

  void seek_by(double offset_s) {
    if (!std::isfinite(offset_s)) throw Refusal{"offset_s is not a number"};
    const double position_s = playback_.position_s(position_ns()) + offset_s;
    seek(std::clamp(playback_.log_time_ns(position_s), playback_.start_ns(), playback_.end_ns()));
  }

  void set_rate(double rate) {
    if (!(rate >= kSlowestPlay && rate <= kFastestPlay)) {
      throw Refusal{fmt::format("rate {} is outside [{}, {}]", rate, kSlowestPlay, kFastestPlay)};
    }
    timeline_.set_rate(now(), rate);
    ahead_.set_rate(rate);
    tell_clock();
  }

  /// `act(request)` does it; the status answers.
  template <class Request>
  void serve(std::string_view name, std::function<void(const Request&)> act) {
    bus_.serve(name, Request::default_instance(), v1::PlayerStatus::default_instance(),
               [this, act](const std::string& bytes) -> tl::expected<std::string, Status> {
                 Request request;
                 if (!request.ParseFromString(bytes)) {
                   return tl::unexpected(Status{"not a " + Request::descriptor()->full_name()});
                 }
                 ring();  // the next due message may be another one then
                 try {
                   act(request);
                 } catch (const Refusal& refusal) {
                   return tl::unexpected(Status{refusal.why});
                 }
                 return status().SerializeAsString();
               });
  }

  /// `answer` tells something else.
  template <class Request, class Answer>
  void serve(std::string_view name, Answer (PacedPlayer::*answer)(const Request&)) {
    bus_.serve(name, Request::default_instance(), Answer::default_instance(),
               [this, answer](const std::string& bytes) -> tl::expected<std::string, Status> {
                 Request request;
                 if (!request.ParseFromString(bytes))
                   return tl::unexpected(Status{"not a " + Request::descriptor()->full_name()});
                 return (this->*answer)(request).SerializeAsString();
               });
  }

  void serve_requests() {
    serve<v1::PlayerPause>("pause", [this](const auto&) { pause(); });
    serve<v1::PlayerResume>("resume", [this](const auto&) { resume(); });
    serve<v1::PlayerStep>("step", [this](const auto& request) { step(request.topic()); });
    serve<v1::PlayerSeek>("seek", [this](const auto& request) { seek(request); });
    serve<v1::PlayerRate>("rate", [this](const auto& request) { set_rate(request.rate()); });
    serve<v1::PlayerAsk>("status", [](const auto&) {});
    serve("marks", &PacedPlayer::marks);
    serve("curves", &PacedPlayer::curves);
  }

  v1::PlayerMarks marks(const v1::PlayerAsk&) { return marks_.found(); }
  v1::PlayerCurves curves(const v1::PlayerCurvesAsk& ask) { return curves_.draw(ask); }

  v1::PlayerStatus status() {
    v1::PlayerStatus s;
    s.set_paused(paused_);
    s.set_stepping(step_to_.has_value());
    s.set_at_end(ahead_.ended());
    s.set_log_time_ns(position_ns());
    s.set_position_s(playback_.position_s(s.log_time_ns()));
    s.set_start_s(playback_.position_s(playback_.start_ns()));
    s.set_end_s(playback_.position_s(playback_.end_ns()));
    s.set_rate(timeline_.rate());
    s.set_messages(messages_);
    s.set_topic(last_topic_);
    s.set_pass(static_cast<std::uint32_t>(pass_));
    s.set_holding(holding_);
    s.set_held_s(to_seconds(held_));
    if (restorer_) {
      const PlayRestorer::Progress p = restorer_->progress();
      s.set_restored(p.computed);
      s.set_elided(p.all);
      s.set_restore_problem(p.problem);
    }
    return s;
  }

  /// Prints the played messages; returns the exit code.
  int report() {
    ahead_.stop();
    const std::uint64_t missed = bus_.overflow() + bus_.backlog();
    const double seconds = to_seconds(going_), mb = static_cast<double>(output_.bytes()) * 1e-6;
    const double mb_s = seconds > 0.0 ? mb / seconds : 0.0;
    const double p50_s = to_seconds(lateness_.quantile(0.5)),
                 p99_s = to_seconds(lateness_.quantile(0.99)),
                 max_s = to_seconds(lateness_.worst());
    if (options_.json) {
      const nlohmann::ordered_json all{{"files", options_.files},  {"messages", messages_},
                                       {"bytes", output_.bytes()}, {"passes", pass_},
                                       {"seconds", seconds},       {"mb_s", mb_s},
                                       {"late_p50_s", p50_s},      {"late_p99_s", p99_s},
                                       {"late_max_s", max_s},      {"held_s", to_seconds(held_)},
                                       {"missed", missed}};
      std::cout << json_text(all) << std::endl;
    }
    std::cerr << fmt::format(
        "{} messages played, {:.1f} MB in {:.3f} s: {:.1f} MB/s; late by {:.3f} ms (median), "
        "{:.3f} ms (99 %), {:.3f} ms (most)\n",
        messages_, mb, seconds, mb_s, p50_s * 1e3, p99_s * 1e3, max_s * 1e3);
    if (held_.count() > 0) {
      std::cerr << fmt::format(
          "recorded time stood for {:.3f} s: slow subscribers were waited for\n",
          to_seconds(held_));
    }
    if (missed > 0) std::cerr << fmt::format("subscribers missed {} messages\n", missed);
    const bool whole = playback_.report_damages() == 0 && missed == 0;
    if (stop_signal_.requested()) return 130;
    return whole ? 0 : 1;
  }

  const PlayOptions& options_;
  Playback& playback_;
  runtime::StopSignal stop_signal_;
  launch::Fd bell_{eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)};
  PlayAhead ahead_;
  runtime::ZmqBus bus_;
  PlayOutput output_;
  PlayTimeline timeline_;
  StatusLine line_;
  const bool on_terminal_ = isatty(STDERR_FILENO) == 1;
  PlayLateness lateness_;

  bool paused_, given_up_ = false;
  PlayMarks marks_;
  PlayCurves curves_;
  bool holding_ = true;                 ///< time stands in any case: subscribers are not there yet
  std::optional<std::string> step_to_;  ///< play up to a message of this topic; empty: of any
  std::string last_topic_;
  int pass_ = 1;
  std::uint64_t messages_ = 0, unserved_ = 0, unserved_bytes_ = 0;
  Wall next_clock_{}, next_restore_{}, going_since_{};
  Time going_{}, held_{};
  std::optional<PlayRestorer> restorer_;  ///< for viewers
};

/// Plays as a member of a lock-step graph: steps exactly at the times of the recorded messages, so
/// that nodes which step after that see them as then. Recorded graph times are kept, so that stamps
/// in the messages stay true; wall times start at 0. At the end of the log it leaves, or (`stay`)
/// remains silent, for others that still have work. Returns the exit code.
int play_in_lockstep(const PlayOptions& options, Playback& playback, const LivePublishing& wish) {
  constexpr double kFirstRate_hz = 1000.0;  // until the first step; then it steps when it has to
  constexpr Time kAfterwards = 1s;          // graph time by which the last messages have been taken
  constexpr std::uint64_t kYear2000_ns = 946'684'800'000'000'000;  // later ones are wall times
  const std::uint64_t shift_ns = playback.start_ns() > kYear2000_ns ? playback.start_ns() : 0;
  const auto graph_time = [shift_ns](std::uint64_t ns) {
    return Time(static_cast<std::int64_t>(ns < shift_ns ? 0 : ns - shift_ns));
  };
  const runtime::StopSignal stop;
  runtime::set_log_name(options.name);
  runtime::BusOptions bus_options = PlayOutput::bus_options(wish, false);
  bus_options.clock = runtime::ClockKind::lockstep;
  runtime::ZmqBus bus(bus_options);
  RawOuts outs = advertise(bus, playback.topics());
  const auto clock = runtime::make_clock(bus_options.clock, bus, kFirstRate_hz, 0.0, stop.fd());
  bus.ready();
  runtime::notify_ready();
  bool begun = false, more = true, leave = false;
  std::uint64_t messages = 0;
  Played next;
  while (const auto now = leave ? std::nullopt : clock->wait()) {
    leave = !more && !options.stay;
    if (!std::exchange(begun, true)) {
      if (launched_as().empty()) demand_leave(wish, bus.known_nodes());  // of those that came since
      for (const Played& value : playback.seek(playback.start_ns())) {
        outs[value.topic]->send_raw(value.payload, graph_time(playback.start_ns()));
      }
      more = playback.next(next);
    }
    for (; more && graph_time(next.log_time_ns) <= *now; more = playback.next(next)) {
      outs[next.topic]->send_raw(next.payload, graph_time(next.publish_time_ns));
      ++messages;
    }
    clock->set_next(more ? graph_time(next.log_time_ns) : *now + kAfterwards);
    clock->done();
  }
  std::cerr << fmt::format("{} messages played{}\n", messages, more ? ", not the whole log" : "");
  if (options.json) {
    std::cout << fmt::format(R"({{"messages":{},"at_end":{}}})", messages, !more) << '\n';
  }
  return playback.report_damages() == 0 ? 0 : 1;
}

/// Returns the exit code: 0, 1 if something could not be read or reached no subscriber, 130 if
/// interrupted. @throws ConfigError, VerbEnd
int log_play(PlayOptions& options) {
  options.playback.filter = filter_of(options.topics);
  options.playback.remap = PlayRemap(options.remaps);
  const bool later = options.as_recorded || options.playback.last_of_all;
  Playback playback(later ? open_logs(options.files) : open_whole_logs(options.files),
                    options.playback);
  for (const std::string& line : playback.notes()) std::cerr << line << '\n';
  if (options.name.empty()) options.name = launched_as().empty() ? "player" : launched_as();
  LivePublishing wish{.verb = "mimesis log play",
                      .self = options.name,
                      .topics = {},
                      .into_live = {options.into_live.begin(), options.into_live.end()}};
  for (const PlayedTopic& topic : playback.topics()) wish.topics.insert(topic.topic);
  for (const std::string& topic : wish.into_live) {
    if (!wish.topics.contains(topic))
      throw ConfigError("--into-live " + topic + ": this topic is not played");
  }
  if (launched_as().empty()) demand_leave(wish, runtime::GraphView().nodes());
  return options.lockstep ? play_in_lockstep(options, playback, wish)
                          : PacedPlayer(options, playback, wish).run();
}

void add_play_choice(CLI::App& play, PlayOptions& o) {
  play.add_option("FILE", o.files, "MCAP files: one log, or its parts")->required();
  add_topic_options(play, o.topics);
  play.add_flag("--all-topics", o.playback.about_nodes,
                "Also the recorded nodes' messages about themselves: NODE/start, steps, health, "
                "log");
  play.add_option("--remap", o.remaps,
                  "OLD:=NEW publishes topic OLD as NEW, OLD/:=NEW/ all below OLD/ (repeatable)")
      ->allow_extra_args(false);
  TimeRange& range = o.playback.range;
  play.add_option("--start", range.start,
                  "From this log time on: seconds from the first message (12.5), absolute "
                  "(12500000000ns) or UTC (2026-11-21T15:40:00.5Z)");
  CLI::Option* duration = play.add_option("--duration", range.duration, "Length of log time");
  play.add_option("--end", range.end, "To this log time")->excludes(duration);
}

void add_play_manner(CLI::App& play, PlayOptions& o) {
  CLI::Option* rate = play.add_option("--rate", o.rate, "Recorded seconds per second")
                          ->check(CLI::Range(kSlowestPlay, kFastestPlay))
                          ->capture_default_str();
  CLI::Option* loop = play.add_option("--loop", o.loops, "Number of passes; 0: until stopped")
                          ->check(number_not_below_zero)
                          ->capture_default_str();
  CLI::Option* paused = play.add_flag("--paused", o.paused, "Start paused");
  play.add_flag("--stay", o.stay,
                "Stay at the end, paused, for seeks and late subscribers; in lock-step: stay a "
                "member");
  CLI::Option* clock =
      play.add_flag("--clock", o.clock, "Drive the clock of a graph that runs on simulated time");
  play.add_flag("--lockstep", o.lockstep,
                "Step with a lock-step graph at the recorded times; leave it at the end")
      ->excludes(clock)
      ->excludes(loop)
      ->excludes(paused)
      ->excludes(rate);
  play.add_option("--read-ahead", o.ahead.seconds,
                  "Recorded time to read ahead [s]; default: 0.5, more when that is too "
                  "little")
      ->check(number_above_zero);
  play.add_option_function<double>(
          "--read-ahead-mb",
          [&o](double mb) { o.ahead.bytes = static_cast<std::size_t>(mb * 1e6); },
          "But not more than this [MB]; default: 134")
      ->check(number_above_zero);
  play.add_option("--name", o.name,
                  "Name of the player in the graph (default: player, or that of the launch file)");
  play.add_option(
          "--into-live", o.into_live,
          "Play this topic even though running nodes publish it or could move a robot by it "
          "(repeatable)")
      ->type_name("TOPIC")
      ->allow_extra_args(false);
  play.add_flag("--for-viewers", o.playback.last_of_all,
                "Recorded stamps; late subscribers and seeks get the last message of every topic; "
                "elided payloads that somebody looks at are computed while it plays")
      ->excludes(clock);
  play.add_flag("--restore-all", o.restore_all, "With --for-viewers: all elided payloads are");
  play.add_flag("--as-recorded", o.as_recorded, "Elided payloads are not computed again");
  play.add_flag("--json", o.json, "Print one JSON object at the end");
}

constexpr const char* kPlayFooter =
    "Positions are seconds from the first message of the log. Latched topics come first, with the\n"
    "last value before the start. clock/time is not played.\n"
    "Steered by services NAME/pause, resume, step, seek, rate, status, marks, curves\n"
    "(proto/player.proto),\n"
    "say mimesis service call player/pause; by a page: mimesis view LOG.\n"
    "Messages leave at their recorded times. Slow reliable subscribers are waited for, and "
    "recorded\n"
    "time stands meanwhile; all others get the newest.\n"
    "Nothing is played that running nodes publish, or by which they could move a robot, unless\n"
    "--into-live names it.\n"
    "Exit code 1 if something could not be read, or a reliable subscriber missed something.\n"
    "Examples:\n"
    "  mimesis log play run.mcap --rate 0.5 --topic camera/image --topic planner/status\n"
    "  mimesis log play run_0.mcap run_1.mcap --start 12.5 --duration 10 --loop 0\n"
    "  mimesis log play run.mcap --remap camera/:=recorded/camera/ --exclude 'world/.*'\n"
    "  mimesis log play run.mcap --clock --paused";

}  // namespace

void add_play(CLI::App& log, int& exit_code) {
  CLI::App* play = log.add_subcommand("play", "Publishes the messages of a log again");
  auto o = std::make_shared<PlayOptions>();
  add_play_choice(*play, *o);
  add_play_manner(*play, *o);
  play->footer(kPlayFooter);
  on_run(*play, exit_code, [o] { return log_play(*o); });
}

}  // namespace mimesis::tool
