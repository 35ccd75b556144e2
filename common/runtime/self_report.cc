#include "common/runtime/self_report.h"

#include <algorithm>

#include "common/runtime/log_lines.h"
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

}  // namespace

SelfReport::SelfReport(ZmqBus& bus) : bus_(bus), health_(bus, kHealthPort), log_(bus, kLogPort) {}

void SelfReport::step_ended(Time now, std::uint64_t overruns) {
  const double took_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
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

}  // namespace mimesis::runtime
