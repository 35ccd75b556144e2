#include "tools/mimesis/log/play.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/runtime/ports.h"
#include "common/runtime/raw.h"
#include "common/runtime/stop_signal.h"
#include "common/runtime/zmq_bus.h"
#include "tools/mimesis/log/lockstep_player.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using runtime::Time;
using Wall = runtime::ZmqBus::WallTime;

constexpr auto kConnect = 2s;  // for those who subscribe already
constexpr auto kLook = 20ms;
constexpr auto kLastWords = 200ms;   // the last messages leave this process
constexpr auto kClockPeriod = 50ms;  // of the clock that the player drives
constexpr std::string_view kClockPort = "time", kClockTopic = "clock/time";

Time now() { return std::chrono::system_clock::now().time_since_epoch(); }
Time time_of(std::uint64_t ns) { return Time(static_cast<std::int64_t>(ns)); }

runtime::BusOptions bus_options(const PlayOptions& options) {
  runtime::BusOptions bus;
  bus.name = options.name;
  if (options.clock) bus.out.emplace(kClockPort, kClockTopic);
  return bus;
}

/// Plays once or several times, paced by the wall clock.
class WallPlayer {
 public:
  explicit WallPlayer(const PlayOptions& options)
      : options_(options),
        playback_(options.file, options.playback),
        bus_(bus_options(options)),
        stop_({stop_signal_.fd()}) {
    for (const PlayedTopic& topic : playback_.topics()) {
      outs_[&topic] = bus_.advertise_raw(topic.topic, topic.type, topic.descriptors,
                                         {.latched = topic.latched});
    }
    if (options.clock)
      clock_ = std::make_unique<runtime::Out<v1::ClockTime>>(bus_, "time",
                                                             runtime::OutOptions{.latched = true});
    bus_.ready();
  }

  int run() {
    await_subscribers();
    for (int loop = 0; running() && (options_.loops == 0 || loop < options_.loops); ++loop) {
      if (loop > 0) playback_.rewind();
      play_once();
    }
    const Wall end = std::chrono::system_clock::now() + kLastWords;
    while (running() && (std::chrono::system_clock::now() < end || bus_.backlog() > 0)) {
      bus_.wait(std::chrono::system_clock::now() + kLook, stop_);
    }
    report();
    return running() ? (playback_.damages().empty() ? 0 : 1) : 130;
  }

 private:
  bool running() const { return !stop_signal_.requested(); }

  /// Nobody who is there already shall miss the first messages.
  void await_subscribers() {
    const Wall give_up = std::chrono::system_clock::now() + kConnect;
    const auto missing = [this] {
      for (const v1::NodeInfo& node : bus_.known_nodes()) {
        for (const v1::TopicInfo& input : node.inputs()) {
          for (const auto& [topic, out] : outs_) {
            if (topic->topic == input.topic() && out->subscribers() == 0) return true;
          }
        }
      }
      return false;
    };
    while (running() && missing() && std::chrono::system_clock::now() < give_up) {
      bus_.wait(std::chrono::system_clock::now() + kLook, stop_);
    }
  }

  void play_once() {
    start_wall_ = now();
    tell_clock();
    for (const auto& [topic, payload] : playback_.latched()) {
      outs_[topic]->send_raw(payload, stamp(playback_.start_time_ns(), playback_.start_time_ns()));
    }
    Played played;
    while (running() && playback_.next(played)) {
      const Time due = wall_of(played.log_time_ns);
      while (running() && now() < due) {
        const Time until = clock_ ? std::min(due, next_clock_) : due;
        bus_.wait(Wall(std::chrono::duration_cast<Wall::duration>(until)), stop_);
        if (clock_ && now() >= next_clock_) tell_clock();
      }
      if (!running()) break;
      worst_delay_ = std::max(worst_delay_, now() - due);
      outs_[played.topic]->send_raw(played.payload,
                                    stamp(played.log_time_ns, played.publish_time_ns));
      ++messages_;
      if (messages_ % 64 == 0) bus_.wait(std::chrono::system_clock::now(), stop_);  // late joiners
    }
  }

  Time wall_of(std::uint64_t log_time_ns) const {
    const double s =
        static_cast<double>(log_time_ns - playback_.start_time_ns()) * 1e-9 / options_.rate;
    return start_wall_ + runtime::from_seconds(s);
  }

  /// What subscribers hold against their own clock: the recorded stamp if we drive that clock, else
  /// now less the age that the message had when it was recorded.
  Time stamp(std::uint64_t log_time_ns, std::uint64_t publish_time_ns) const {
    if (clock_) return time_of(publish_time_ns);
    return now() - (time_of(log_time_ns) - time_of(publish_time_ns));
  }

  void tell_clock() {
    if (!clock_) return;
    const Time wall = now();
    v1::ClockTime message;
    const double played_s = runtime::to_seconds(wall - start_wall_) * options_.rate;
    const Time time = time_of(playback_.start_time_ns()) + runtime::from_seconds(played_s);
    message.set_time_ns(static_cast<std::uint64_t>(time.count()));
    message.set_wall_ns(static_cast<std::uint64_t>(wall.count()));
    message.set_factor(options_.rate);
    clock_->send(message, time);
    next_clock_ = wall + kClockPeriod;
  }

  void report() const {
    const double delay_s = runtime::to_seconds(worst_delay_);
    if (options_.json) {
      const nlohmann::ordered_json out{
          {"file", options_.file}, {"messages", messages_}, {"worst_delay_s", delay_s}};
      std::cout << out.dump() << std::endl;
    }
    std::cerr << fmt::format("{}: {} messages played, at most {:.1f} ms late\n", options_.file,
                             messages_, delay_s * 1e3);
    for (const auto& d : playback_.damages()) {
      std::cerr << fmt::format("{}: byte {}: {}\n", options_.file, d.offset, d.what);
    }
  }

  PlayOptions options_;
  Playback playback_;
  runtime::StopSignal stop_signal_;
  runtime::ZmqBus bus_;
  std::array<int, 1> stop_;
  std::map<const PlayedTopic*, std::unique_ptr<runtime::RawOut>> outs_;
  std::unique_ptr<runtime::Out<v1::ClockTime>> clock_;
  Time start_wall_{}, next_clock_{}, worst_delay_{};
  std::uint64_t messages_ = 0;
};

}  // namespace

int log_play(const PlayOptions& options) {
  if (const auto file = log::open_file(options.file); !file) {
    std::cerr << file.error().reason << '\n';
    return 3;  // not found, as of `log info`
  }
  PlayOptions checked = options;
  // The time of the recorded run is not the time of this one.
  checked.playback.topic = [wanted = options.playback.topic](const std::string& topic) {
    return topic != kClockTopic && (!wanted || wanted(topic));
  };
  if (options.lockstep) return play_in_lockstep(checked);
  return WallPlayer(checked).run();
}

}  // namespace mimesis::tool
