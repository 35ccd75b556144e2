#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "common/runtime/ports.h"
#include "common/runtime/step_recorder.h"
#include "common/runtime/zmq_bus.h"
#include "proto/foxglove/log.pb.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {

/// A node's report about itself: NODE/health once per second of graph time, its log lines on
/// NODE/log.
class SelfReport {
 public:
  explicit SelfReport(ZmqBus& bus);

  void step_begins() { began_ = std::chrono::steady_clock::now(); }
  /// Publishes reports that are due. `overruns`: since the start.
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

/// Records that make a node's run replayable: NODE/start (latched) at its first step, NODE/steps
/// ten times a second of graph time.
class StepReport {
 public:
  /// @param parameters  effective ones, YAML
  StepReport(ZmqBus& bus, const BusOptions& options, const std::string& parameters);

  /// For the node.
  Bus& bus() { return recorded_bus_; }
  void begin(v1::StepKind kind, Time now);
  void end();
  /// Publishes the steps that are still held.
  void publish(Time now);

 private:
  void publish_start(Time now);

  ZmqBus& bus_;
  std::string parameters_;
  StepRecorder recorder_;
  RecordedBus recorded_bus_;
  Out<v1::NodeStart> start_;
  Out<v1::StepLog> steps_;
  bool started_ = false;
  std::optional<Time> open_;  ///< time of the step that runs
};

}  // namespace mimesis::runtime
