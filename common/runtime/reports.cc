#include "common/runtime/reports.h"

#include <algorithm>

#include "common/runtime/log.h"
#include "common/runtime/own_topics.h"

namespace mimesis::runtime {
namespace {

constexpr Time kPeriod = std::chrono::seconds(1);

foxglove::Log::Level to_foxglove(Level level) {
  switch (level) {
    case Level::debug:
      return foxglove::Log::DEBUG;
    case Level::info:
      return foxglove::Log::INFO;
    case Level::warn:
      return foxglove::Log::WARNING;
    case Level::error:
      return foxglove::Log::ERROR;
  }
  return foxglove::Log::UNKNOWN;
}

/// File name of this process's program.
std::string program(const v1::NodeInfo& info) {
  const std::string& path = info.executable();
  return path.substr(path.rfind('/') + 1);
}

}  // namespace

SelfReport::SelfReport(ZmqBus& bus) : bus_(bus), health_(bus, kHealthPort), log_(bus, kLogPort) {}

void SelfReport::step_ended(Time now, std::uint64_t overruns) {
  const double took_s = to_seconds(std::chrono::steady_clock::now() - began_);
  ++steps_;
  ++steps_in_period_;
  worst_s_ = std::max(worst_s_, took_s);
  sum_s_ += took_s;
  publish_log(now);
  if (next_ == Time(0) || now < next_ - 2 * kPeriod)
    next_ = now + kPeriod;  // first, or the clock went back
  if (now >= next_) publish_health(now, overruns);
}

void SelfReport::publish_health(Time now, std::uint64_t overruns) {
  v1::Health health;
  health.set_node(bus_.node());
  health.set_steps(steps_);
  health.set_overruns(overruns);
  health.set_worst_step_s(worst_s_);
  health.set_mean_step_s(sum_s_ / static_cast<double>(steps_in_period_));
  for (v1::InputHealth& input : bus_.input_health(now)) *health.add_inputs() = std::move(input);
  health.set_sent(bus_.sent());
  health.set_backlog(bus_.backlog());
  health.set_overflow(bus_.overflow());
  health.set_malformed(bus_.malformed());
  health_.send(health, now);
  worst_s_ = sum_s_ = 0.0;
  steps_in_period_ = 0;
  while (next_ <= now) next_ += kPeriod;
}

void SelfReport::publish_log(Time now) {
  for (LogLine& line : take_log_lines()) {
    foxglove::Log message;
    message.set_level(to_foxglove(line.level));
    message.set_message(std::move(line.text));
    message.set_name(bus_.node());
    log_.send(message, now);
  }
}

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
