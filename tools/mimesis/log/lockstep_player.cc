#include "tools/mimesis/log/lockstep_player.h"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <map>

#include "common/runtime/log_lines.h"
#include "common/runtime/node_clock.h"
#include "common/runtime/stop_signal.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using runtime::Time;
constexpr std::uint64_t kYear2000Ns = 946'684'800'000'000'000;  // later log times are wall time
constexpr double kFirstRate_hz = 1000.0;  // until the first step; then it steps when it has to
constexpr Time kAfterwards = 1s;  // of graph time: the last messages have been taken by then

/// Steps exactly when a message was recorded, so that whoever steps after that sees it, as then.
/// Recorded graph times are kept, so that stamps in the messages stay true; wall times start at 0.
class LockstepPlayer {
 public:
  LockstepPlayer(runtime::ZmqBus& bus, Playback& playback) : playback_(playback) {
    if (playback.start_ns() > kYear2000Ns) shift_ns_ = playback.start_ns();
    for (const PlayedTopic& topic : playback.topics()) {
      outs_[&topic] =
          bus.advertise_raw(topic.topic, topic.type, topic.descriptors, {.latched = topic.latched});
    }
  }

  void step(Time now) {
    if (!started_) {
      started_ = true;
      for (const PlayedValue& value : playback_.seek(playback_.start_ns())) {
        outs_[value.topic]->send_raw(value.payload, graph_time(playback_.start_ns()));
      }
      more_ = playback_.next(next_);
    }
    for (; more_ && graph_time(next_.log_time_ns) <= now; more_ = playback_.next(next_)) {
      outs_[next_.topic]->send_raw(next_.payload, graph_time(next_.publish_time_ns));
      ++messages_;
    }
  }
  /// Of the next message; nothing at the end.
  std::optional<Time> next() const {
    return more_ ? std::optional(graph_time(next_.log_time_ns)) : std::nullopt;
  }
  std::uint64_t messages() const { return messages_; }

 private:
  Time graph_time(std::uint64_t ns) const {
    return Time(static_cast<std::int64_t>(ns < shift_ns_ ? 0 : ns - shift_ns_));
  }

  Playback& playback_;
  std::uint64_t shift_ns_ = 0, messages_ = 0;
  std::map<const PlayedTopic*, std::unique_ptr<runtime::RawOut>> outs_;
  bool started_ = false, more_ = false;
  Played next_;
};

}  // namespace

int play_in_lockstep(const PlayOptions& options, Playback& playback) {
  const runtime::StopSignal stop;
  runtime::set_log_name(options.name);
  runtime::BusOptions bus_options;
  bus_options.name = options.name;
  bus_options.clock = runtime::ClockKind::lockstep;
  runtime::ZmqBus bus(bus_options);
  LockstepPlayer player(bus, playback);
  const auto clock = runtime::make_lockstep_clock(bus, kFirstRate_hz, 0.0, stop.fd());
  bus.ready();
  runtime::notify_ready();
  bool at_end = false;
  while (const auto now = clock->wait()) {
    const bool leave = at_end && !options.stay;
    player.step(*now);
    at_end = !player.next();
    clock->set_next(player.next().value_or(*now + kAfterwards));
    clock->done();
    if (leave) break;
  }
  std::cerr << fmt::format("{} messages played{}\n", player.messages(),
                           at_end ? "" : ", not the whole log");
  if (options.json) {
    std::cout << fmt::format(R"({{"messages":{},"at_end":{}}})", player.messages(), at_end) << '\n';
  }
  return playback.report_damages() == 0 ? 0 : 1;
}

}  // namespace mimesis::tool
