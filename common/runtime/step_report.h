#pragma once
#include <memory>
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
  /// @param recorded    false: nothing is recorded, `bus()` is `bus` itself
  StepReport(ZmqBus& bus, const BusOptions& options, const std::string& parameters, bool recorded);

  /// For the node.
  Bus& bus();
  void begin(v1::StepKind kind, Time now);
  void end();
  /// What has not been published yet.
  void publish(Time now);

 private:
  struct Recorded {
    Recorded(ZmqBus& inner, const BusOptions& options);
    StepRecorder recorder;
    RecordedBus bus;
    Out<v1::NodeStart> start;
    Out<v1::StepLog> steps;
  };
  void publish_start(Time now);

  ZmqBus& bus_;
  std::string parameters_;
  std::unique_ptr<Recorded> recorded_;
  bool started_ = false;
  std::optional<Time> open_;  ///< time of the step that runs
};

}  // namespace mimesis::runtime
