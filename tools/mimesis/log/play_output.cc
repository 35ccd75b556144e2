#include "tools/mimesis/log/play_output.h"

#include <algorithm>
#include <limits>

#include "common/runtime/raw.h"

namespace mimesis::tool {
namespace {

using runtime::Time;
constexpr std::string_view kClockPort = "time", kClockTopic = "clock/time";
/// Nodes hold on to the last factor above 0; repeated every 50 ms, this one moves time by 50 ns.
constexpr double kStanding = 1e-6;

Time wall_now() { return std::chrono::system_clock::now().time_since_epoch(); }

}  // namespace

Time play_time(std::uint64_t ns) {
  constexpr auto kEnd = static_cast<std::uint64_t>(std::numeric_limits<Time::rep>::max() / 2);
  return Time(static_cast<Time::rep>(std::min(ns, kEnd)));
}

runtime::BusOptions PlayOutput::bus_options(const std::string& name, bool clock) {
  runtime::BusOptions options;
  options.name = name;
  if (clock) options.out.emplace(kClockPort, kClockTopic);
  return options;
}

PlayOutput::PlayOutput(runtime::ZmqBus& bus, const std::vector<PlayedTopic>& topics, bool clock)
    : bus_(bus) {
  for (const PlayedTopic& topic : topics) {
    outs_[&topic] =
        bus.advertise_raw(topic.topic, topic.type, topic.descriptors, {.latched = topic.latched});
  }
  if (clock) {
    clock_ = std::make_unique<runtime::Out<v1::ClockTime>>(bus, kClockPort,
                                                           runtime::OutOptions{.latched = true});
  }
}

bool PlayOutput::awaits_subscribers() const {
  for (const v1::NodeInfo& node : bus_.known_nodes()) {
    for (const v1::TopicInfo& input : node.inputs()) {
      for (const auto& [topic, out] : outs_) {
        if (topic->topic == input.topic() && out->subscribers() == 0) return true;
      }
    }
  }
  return false;
}

void PlayOutput::send(const PlayedTopic* topic, std::string_view payload, std::uint64_t log_time_ns,
                      std::uint64_t publish_time_ns) {
  // What subscribers hold against their own clock: the recorded stamp if we drive that clock, else
  // now less the age that the message had when it was recorded.
  const Time stamp = clock_ ? play_time(publish_time_ns)
                            : wall_now() - (play_time(log_time_ns) - play_time(publish_time_ns));
  outs_[topic]->send_raw(payload, stamp);
  bytes_ += payload.size();
}

void PlayOutput::send(const Played& m) {
  send(m.topic, m.payload, m.log_time_ns, m.publish_time_ns);
}

void PlayOutput::send(const PlayedValue& value) {
  send(value.topic, value.payload, value.log_time_ns, value.publish_time_ns);
}

void PlayOutput::tell_clock(Time log_time, double factor) {
  if (!clock_) return;
  v1::ClockTime message;
  message.set_time_ns(static_cast<std::uint64_t>(log_time.count()));
  message.set_wall_ns(static_cast<std::uint64_t>(wall_now().count()));
  message.set_factor(factor > 0.0 ? factor : kStanding);
  clock_->send(message, log_time);
}

}  // namespace mimesis::tool
