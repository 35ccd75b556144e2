#pragma once
#include <optional>
#include <string>

#include "common/runtime/ports.h"
#include "common/runtime/step_recorder.h"
#include "common/runtime/zmq_bus.h"

namespace mimesis::runtime {

/// What makes a node's run replayable: NODE/start (latched) at its first step, NODE/steps ten times
/// a second of graph time.
class StepReport {
 public:
  /// @param parameters  effective ones, YAML
  StepReport(ZmqBus& bus, const BusOptions& options, const std::string& parameters);

  /// For the node.
  Bus& bus() { return recorded_bus_; }
  void begin(v1::StepKind kind, Time now);
  void end();
  /// What has not been published yet.
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
