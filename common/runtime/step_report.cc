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

StepReport::Recorded::Recorded(ZmqBus& inner, const BusOptions& options)
    : bus(inner, recorder, options.in),
      start(inner, kStartPort, {.latched = true}),
      steps(inner, kStepsPort) {}

StepReport::StepReport(ZmqBus& bus, const BusOptions& options, const std::string& parameters,
                       bool recorded)
    : bus_(bus), parameters_(parameters) {
  if (recorded) recorded_ = std::make_unique<Recorded>(bus, options);
}

Bus& StepReport::bus() {
  if (recorded_) return recorded_->bus;
  return bus_;
}

void StepReport::begin(v1::StepKind kind, Time now) {
  if (!recorded_) return;
  if (kind == v1::STEP_KIND_STEP && !started_) publish_start(now);
  recorded_->recorder.begin(kind, now);
  open_ = now;
}

void StepReport::end() {
  if (!recorded_ || !open_) return;
  recorded_->recorder.end();
  if (recorded_->recorder.due(*open_)) publish(*open_);
  open_.reset();
}

void StepReport::publish(Time now) {
  if (!recorded_) return;
  v1::StepLog& log = recorded_->recorder.take();
  if (!log.steps().empty()) recorded_->steps.send(log, now);
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
  recorded_->start.send(start, now);
}

}  // namespace mimesis::runtime
