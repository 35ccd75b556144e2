#pragma once
#include <map>
#include <memory>
#include <span>

#include "common/runtime/ports.h"
#include "common/runtime/zmq_bus.h"
#include "proto/runtime.pb.h"
#include "tools/mimesis/log/playback.h"

namespace mimesis::tool {

/// The player's side of the graph: its topics and, if it drives it, the graph's clock.
class PlayOutput {
 public:
  PlayOutput(runtime::ZmqBus& bus, const std::vector<PlayedTopic>& topics, bool clock);
  /// What the bus of a player needs; `clock`: it drives the clock.
  static runtime::BusOptions bus_options(const std::string& name, bool clock);

  /// Somebody who listens to one of the topics is not connected yet.
  bool awaits_subscribers() const;
  void send(const Played& message);
  /// A latched value of before the place where playing starts.
  void send(const PlayedValue& value);
  /// `factor`: simulated seconds per second; 0: time stands still.
  void tell_clock(runtime::Time log_time, double factor);
  bool clock() const { return clock_ != nullptr; }
  std::uint64_t bytes() const { return bytes_; }  ///< of payloads sent

 private:
  void send(const PlayedTopic* topic, std::string_view payload, std::uint64_t log_time_ns,
            std::uint64_t publish_time_ns);

  runtime::ZmqBus& bus_;
  std::map<const PlayedTopic*, std::unique_ptr<runtime::RawOut>> outs_;
  std::unique_ptr<runtime::Out<v1::ClockTime>> clock_;
  std::uint64_t bytes_ = 0;
};

/// A log time on the runtime's scale; beyond its end, the end.
runtime::Time play_time(std::uint64_t ns);

}  // namespace mimesis::tool
