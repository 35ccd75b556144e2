#pragma once
#include <chrono>
#include <cstdint>

#include "common/runtime/ports.h"
#include "common/runtime/zmq_bus.h"
#include "proto/foxglove/log.pb.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {

/// What a node says about itself: NODE/health once per second of graph time, its log lines on
/// NODE/log.
class SelfReport {
 public:
  explicit SelfReport(ZmqBus& bus);

  void step_begins() { began_ = std::chrono::steady_clock::now(); }
  /// Publishes what is due. `overruns`: since the start.
  void step_ended(Time now, std::uint64_t overruns);
  /// The lines logged since the last step.
  void publish_log(Time now);

 private:
  void publish_health(Time now, std::uint64_t overruns);

  ZmqBus& bus_;
  Out<v1::Health> health_;
  Out<foxglove::Log> log_;
  std::chrono::steady_clock::time_point began_{};
  std::uint64_t steps_ = 0, steps_in_period_ = 0;
  double worst_s_ = 0.0, sum_s_ = 0.0;
  Time next_{};
};

}  // namespace mimesis::runtime
