#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "common/runtime/node_clock.h"
#include "common/runtime/ports.h"
#include "common/runtime/raw.h"
#include "common/runtime/zmq_bus.h"
#include "common/time.h"
#include "proto/player.pb.h"
#include "proto/runtime.pb.h"
#include "tools/mimesis/graph_tools.h"
#include "tools/mimesis/log/playback.h"
#include "tools/mimesis/log/story.h"

// Parts of a player: where it is in the log and how late, the marks of its time line, and its side
// of the graph.
namespace mimesis::tool {

/// Where in the log a player is: t = t₀ + rate·(w − w₀) while it runs. Log times t [ns], wall times
/// w of the steady clock, which no one sets.
class PlayTimeline {
 public:
  using Wall = std::chrono::steady_clock::time_point;

  /// Stands at log time 0. `rate`: recorded seconds per second of wall time, above 0 [1]
  explicit PlayTimeline(double rate) : rate_(rate) {}

  bool running() const { return running_; }
  double rate() const { return rate_; }
  runtime::Time at(Wall now) const {
    if (!running_) return log_time_;
    return log_time_ +
           runtime::Time(std::llround(rate_ * static_cast<double>((now - wall_).count())));
  }
  /// When `log_time` is reached, as things are. Precondition: running.
  Wall due(runtime::Time log_time) const {
    constexpr double kFar_ns = 1e18;  // 31 years
    const double left_ns = static_cast<double>((log_time - log_time_).count()) / rate_;
    return wall_ + std::chrono::nanoseconds(std::llround(std::clamp(left_ns, -kFar_ns, kFar_ns)));
  }

  void jump(Wall now, runtime::Time log_time) {
    wall_ = now;
    log_time_ = log_time;
  }
  void run(Wall now) {
    jump(now, at(now));
    running_ = true;
  }
  void stand(Wall now) {
    jump(now, at(now));
    running_ = false;
  }
  void set_rate(Wall now, double rate) {
    jump(now, at(now));
    rate_ = rate;
  }

 private:
  double rate_;
  bool running_ = false;
  Wall wall_{};
  runtime::Time log_time_{};
};

/// How late messages were played: counts in bins whose width is 1/32 of their octave, so quantiles
/// are at most 3 % too high. Does not allocate.
class PlayLateness {
 public:
  void add(runtime::Time late) {  ///< too early counts as 0
    const auto ns = static_cast<std::uint64_t>(std::max<runtime::Time::rep>(late.count(), 0));
    // The leading bit chooses the octave, the five below it the bin.
    const auto octave =
        static_cast<std::size_t>(std::max(static_cast<int>(std::bit_width(ns)) - 6, 0));
    const std::size_t bin = octave * kPerOctave + (ns >> octave);
    ++bins_[std::min(bin, bins_.size() - 1)];
    ++count_;
    worst_ = std::max(worst_, late);
  }
  std::uint64_t count() const { return count_; }
  runtime::Time worst() const { return worst_; }
  /// Upper end of the bin below which `share` of all lie; 0 without any.
  runtime::Time quantile(double share) const {
    const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
    std::uint64_t below = 0;
    for (std::size_t bin = 0; bin < bins_.size() && count_ > 0; ++bin) {
      below += bins_[bin];
      if (below < std::max<std::uint64_t>(wanted, 1)) continue;
      // Inverse of `add`: bins below 64 hold one value each.
      const std::size_t octave = bin < 2 * kPerOctave ? 0 : bin / kPerOctave - 1;
      const std::uint64_t low = bin - octave * kPerOctave;
      return std::min(worst_, runtime::Time(((low + 1) << octave) - 1));
    }
    return {};
  }

 private:
  static constexpr std::size_t kPerOctave = 32, kOctaves = 60;
  std::array<std::uint64_t, kPerOctave * kOctaves> bins_{};
  std::uint64_t count_ = 0;
  runtime::Time worst_{};
};

/// What happened, for a time line. A thread of its own reads it from the log when it is first asked
/// for: the player goes on meanwhile.
class PlayMarks {
 public:
  explicit PlayMarks(const Playback& playback) : playback_(playback) {}

  /// Those found so far; at most kMost, then the rest of the log is left out.
  v1::PlayerMarks found() {
    if (!reader_.joinable())
      reader_ = std::jthread([this](const std::stop_token& stop) { read(stop); });
    const std::lock_guard lock(mutex_);
    return marks_;
  }

 private:
  static constexpr int kMost = 2000;

  void read(const std::stop_token& stop) {
    const auto reader =
        playback_.reader({Story::follows, playback_.start_ns(), playback_.end_ns() + 1});
    Story story;
    int count = 0;
    while (const Item* item = stop.stop_requested() || count == kMost ? nullptr : reader->next()) {
      v1::PlayerMark mark = story.tell(*item);
      if (mark.kind() == v1::PlayerMark::KIND_UNSPECIFIED) continue;
      mark.set_position_s(playback_.position_s(item->message->log_time));
      const std::lock_guard lock(mutex_);
      *marks_.add_marks() = std::move(mark);
      ++count;
    }
    const std::lock_guard lock(mutex_);
    marks_.set_whole(true);
  }

  const Playback& playback_;
  std::mutex mutex_;
  v1::PlayerMarks marks_;  ///< guarded by mutex_
  std::jthread reader_;    ///< ends before what it uses
};

/// A log time on the runtime's scale, limited to half its range.
inline runtime::Time play_time(std::uint64_t ns) {
  constexpr auto kEnd =
      static_cast<std::uint64_t>(std::numeric_limits<runtime::Time::rep>::max() / 2);
  return runtime::Time(static_cast<runtime::Time::rep>(std::min(ns, kEnd)));
}

using RawOuts = std::map<const PlayedTopic*, std::unique_ptr<runtime::RawOut>>;

/// `keep`: late subscribers get the last message of every topic.
inline RawOuts advertise(runtime::ZmqBus& bus, const std::deque<PlayedTopic>& topics,
                         bool keep = false) {
  RawOuts outs;
  for (const PlayedTopic& topic : topics) {
    outs[&topic] = bus.advertise_raw(topic.topic, topic.type, topic.descriptors,
                                     {.latched = topic.latched || keep});
  }
  return outs;
}

/// The player's side of the graph: its topics and, if it drives it, the graph's clock.
class PlayOutput {
 public:
  /// `for_viewers`: the last message of every topic is kept, and stamps are the recorded ones.
  PlayOutput(runtime::ZmqBus& bus, const std::deque<PlayedTopic>& topics, bool clock,
             bool for_viewers)
      : bus_(bus),
        outs_(advertise(bus, topics, for_viewers)),
        recorded_stamps_(clock || for_viewers) {
    if (!clock) return;
    clock_ = std::make_unique<runtime::Out<v1::ClockTime>>(bus, kPort,
                                                           runtime::OutOptions{.latched = true});
  }
  static runtime::BusOptions bus_options(const LivePublishing& wish, bool clock) {
    runtime::BusOptions options;
    options.name = wish.self;
    options.into_live = wish.into_live;
    if (clock) options.out.emplace(kPort, "clock/time");
    return options;
  }

  /// A subscriber of one of the topics is not connected yet.
  bool awaits_subscribers() const {
    for (const v1::NodeInfo& node : bus_.known_nodes()) {
      for (const v1::TopicInfo& input : node.inputs()) {
        for (const auto& [topic, out] : outs_) {
          if (topic->topic == input.topic() && out->subscribers() == 0) return true;
        }
      }
    }
    return false;
  }
  bool has_subscribers(const PlayedTopic& topic) const {
    return outs_.at(&topic)->subscribers() > 0;
  }
  void send(const Played& message) {
    // Subscribers compare the stamp with their own clock: it is the recorded one if the player
    // drives that clock, else now less the age that the message had when it was recorded.
    const runtime::Time sent = play_time(message.publish_time_ns);
    const runtime::Time stamp =
        recorded_stamps_ ? sent : wall() - (play_time(message.log_time_ns) - sent);
    outs_[message.topic]->send_raw(message.payload, stamp);
    bytes_ += message.payload.size();
  }
  /// `factor`: simulated seconds per second; 0: time stands still.
  void tell_clock(runtime::Time log_time, double factor) {
    if (!clock_) return;
    // Nodes hold on to the last factor above 0; repeated every 50 ms, this one moves time by 50 ns.
    constexpr double kStanding = 1e-6;
    v1::ClockTime message;
    message.set_time_ns(static_cast<std::uint64_t>(log_time.count()));
    message.set_wall_ns(static_cast<std::uint64_t>(wall().count()));
    message.set_factor(factor > 0.0 ? factor : kStanding);
    clock_->send(message, log_time);
  }
  bool clock() const { return clock_ != nullptr; }
  std::uint64_t bytes() const { return bytes_; }  ///< size of the payloads sent

 private:
  static constexpr std::string_view kPort = "time";
  runtime::Time wall() const { return bus_.time().now(); }

  runtime::ZmqBus& bus_;
  RawOuts outs_;
  const bool recorded_stamps_;
  std::unique_ptr<runtime::Out<v1::ClockTime>> clock_;
  std::uint64_t bytes_ = 0;
};

}  // namespace mimesis::tool
