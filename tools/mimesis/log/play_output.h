#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <limits>
#include <map>
#include <memory>
#include <string>

#include "common/error.h"
#include "common/runtime/node_clock.h"
#include "common/runtime/ports.h"
#include "common/runtime/raw.h"
#include "common/runtime/zmq_bus.h"
#include "proto/runtime.pb.h"
#include "tools/mimesis/live_topics.h"
#include "tools/mimesis/log/playback.h"

// A player in the graph.
namespace mimesis::tool {

/// A log time on the runtime's scale, limited to half its range.
inline runtime::Time play_time(std::uint64_t ns) {
  constexpr auto kEnd =
      static_cast<std::uint64_t>(std::numeric_limits<runtime::Time::rep>::max() / 2);
  return runtime::Time(static_cast<runtime::Time::rep>(std::min(ns, kEnd)));
}

using RawOuts = std::map<const PlayedTopic*, std::unique_ptr<runtime::RawOut>>;

inline RawOuts advertise(runtime::ZmqBus& bus, const std::deque<PlayedTopic>& topics) {
  RawOuts outs;
  for (const PlayedTopic& topic : topics) {
    outs[&topic] =
        bus.advertise_raw(topic.topic, topic.type, topic.descriptors, {.latched = topic.latched});
  }
  return outs;
}

/// The player's side of the graph: its topics and, if it drives it, the graph's clock.
class PlayOutput {
 public:
  PlayOutput(runtime::ZmqBus& bus, const std::deque<PlayedTopic>& topics, bool clock)
      : bus_(bus), outs_(advertise(bus, topics)) {
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
  void send(const Played& message) {
    // Subscribers compare the stamp with their own clock: it is the recorded one if the player
    // drives that clock, else now less the age that the message had when it was recorded.
    const runtime::Time sent = play_time(message.publish_time_ns);
    const runtime::Time stamp = clock_ ? sent : wall() - (play_time(message.log_time_ns) - sent);
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
  std::unique_ptr<runtime::Out<v1::ClockTime>> clock_;
  std::uint64_t bytes_ = 0;
};

}  // namespace mimesis::tool
