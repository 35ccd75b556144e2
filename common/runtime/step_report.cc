#include "common/runtime/step_report.h"

#include "common/runtime/own_topics.h"

namespace mimesis::runtime {
namespace {

/// File name of this process's program.
std::string program(const v1::NodeInfo& info) {
  const std::string& path = info.executable();
  return path.substr(path.rfind('/') + 1);
}

}  // namespace

StepReport::StepReport(ZmqBus& bus, const BusOptions& options, const std::string& parameters)
    : bus_(bus),
      parameters_(parameters),
      recorded_bus_(bus, recorder_, options.in),
      start_(bus, kStartPort, {.latched = true}),
      steps_(bus, kStepsPort) {}

void StepReport::begin(v1::StepKind kind, Time now) {
  if (kind == v1::STEP_KIND_STEP && !started_) publish_start(now);
  recorder_.begin(kind, now);
  open_ = now;
}

void StepReport::end() {
  if (!open_) return;
  recorder_.end();
  if (recorder_.due(*open_)) publish(*open_);
  open_.reset();
}

void StepReport::publish(Time now) {
  v1::StepLog& log = recorder_.take();
  if (!log.steps().empty()) steps_.send(log, now);
}

void StepReport::publish_start(Time now) {
  started_ = true;
  const v1::NodeInfo& info = bus_.info();
  v1::NodeStart start;
  start.set_node(info.name());
  start.set_executable(program(info));
  start.set_start_id(info.start_id());
  start.set_clock(info.clock());
  start.set_parameters(parameters_);
  *start.mutable_inputs() = info.inputs();
  *start.mutable_outputs() = info.outputs();
  start.set_version(MIMESIS_VERSION);
  start_.send(start, now);
}

}  // namespace mimesis::runtime
