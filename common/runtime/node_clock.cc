#include "common/runtime/node_clock.h"

#include <algorithm>
#include <array>

#include "common/runtime/conductor.h"
#include "common/runtime/log.h"
#include "common/runtime/ports.h"
#include "common/runtime/sockets.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {
namespace {

class WallClock final : public NodeClock {
 public:
  WallClock(ZmqBus& bus, double rate_hz, double offset_s, int stop_fd)
      : bus_(bus),
        stop_({stop_fd}),
        // Whole seconds as the common origin keep the offsets between nodes.
        schedule_(rate_hz, offset_s, std::chrono::floor<std::chrono::seconds>(now())),
        ahead_(bus.time().system_ahead()) {
    schedule_.skip_past(now());
  }

  std::optional<Time> wait() override {
    if (bus_.wait(bus_.time().when(schedule_.due()), stop_)) return std::nullopt;
    bus_.drain();
    return now();
  }

  void done() override {
    watch_system_clock();
    schedule_.advance();
    if (const Time t = now(); t >= schedule_.due()) {
      ++overruns_;
      schedule_.skip_past(t);  // no burst of late steps
    }
  }
  Time now() const override { return bus_.time().now(); }

 private:
  void watch_system_clock() {
    constexpr Time kStep = std::chrono::milliseconds(100);
    const Time ahead = bus_.time().system_ahead(), by = ahead - ahead_;
    if (by > -kStep && by < kStep) return;
    ahead_ = ahead;
    warn("the system clock was set by {:+.3f} s; the graph's time goes on as before",
         to_seconds(by));
  }

  ZmqBus& bus_;
  std::array<int, 1> stop_;
  Schedule schedule_;
  Time ahead_;  ///< of the system clock, when last looked at
};

using namespace std::chrono_literals;

constexpr std::string_view kPort = ".clock";  // begins with a dot: no port of a node's own
constexpr auto kLook = 20ms;                  // for news of the clock
constexpr auto kRefused = 5ms;                // before the next attempt to join

/// Simulated time runs on between the clock's messages: t = t₀ + factor·(wall − wall₀).
class SimClock final : public NodeClock {
 public:
  SimClock(ZmqBus& bus, double rate_hz, double offset_s, int stop_fd)
      : bus_(bus), rate_hz_(rate_hz), offset_s_(offset_s), stop_({stop_fd}), clock_(bus, kPort) {}

  std::optional<Time> wait() override {
    for (bool said = false;;) {
      bus_.drain();
      if (!follow()) return std::nullopt;
      const Time wall = bus_.time().now();
      if (schedule_ && now() >= schedule_->due()) return now();
      Time until = wall + kLook;
      if (schedule_) until = std::min(until, wall_of(schedule_->due()));
      if (bus_.wait(bus_.time().when(until), stop_)) return std::nullopt;
      if (!schedule_ && !std::exchange(said, true)) info("waits for the clock (topic clock/time)");
    }
  }

  void done() override {
    schedule_->advance();
    if (now() >= schedule_->due()) {
      ++overruns_;
      schedule_->skip_past(now());
    }
  }
  Time now() const override {
    return time_ +
           Time(std::llround(factor_ * static_cast<double>((bus_.time().now() - wall_).count())));
  }

 private:
  Time wall_of(Time t) const {
    return wall_ + Time(std::llround(static_cast<double>((t - time_).count()) / factor_));
  }

  /// False at the end of simulated time.
  bool follow() {
    const v1::ClockTime* news = clock_.take();
    if (news == nullptr) return true;
    if (news->ended()) return false;
    if (!(news->factor() > 0.0)) return true;
    const bool first = !schedule_;
    const Time before = first ? Time(0) : now();
    time_ = Time(static_cast<std::int64_t>(news->time_ns()));
    wall_ = Time(static_cast<std::int64_t>(news->wall_ns()));
    factor_ = news->factor();
    if (first || now() < before - 1s) {  // the clock was started again
      schedule_.emplace(rate_hz_, offset_s_, Time(0));
      schedule_->skip_past(now() - Time(1));
    }
    return true;
  }

  ZmqBus& bus_;
  double rate_hz_, offset_s_;
  std::array<int, 1> stop_;
  Latest<v1::ClockTime> clock_;
  Time time_{}, wall_{};
  double factor_ = 0.0;
  std::optional<Schedule> schedule_;
};

/// A participant of lock-step time: the conductor decides when it steps and which messages the step
/// sees.
class LockstepClock final : public NodeClock {
 public:
  LockstepClock(ZmqBus& bus, double rate_hz, double offset_s, int stop_fd)
      : bus_(bus), stop_fd_(stop_fd) {
    join_.set_node(bus.node());
    join_.set_start_id(bus.info().start_id());
    join_.set_rate_hz(rate_hz);
    join_.set_offset_s(offset_s);
    for (const v1::TopicInfo& input : bus.info().inputs()) join_.add_inputs(input.topic());
  }

  std::optional<Time> wait() override {
    for (;;) {
      if (!conductor_.valid() && !join()) return std::nullopt;
      const std::array<int, 2> fds{stop_fd_, conductor_.fd()};
      // A deadline far away: nothing but a packet or the end is awaited.
      if (!bus_.wait(std::chrono::steady_clock::now() + 1h, fds)) continue;
      switch (conductor_.receive(packet_)) {
        case PacketSocket::Result::nothing:  // so it was the stop signal
          return std::nullopt;
        case PacketSocket::Result::closed:
          if (gone_.pass()) warn("the clock is gone, or refuses this node; waiting for it");
          conductor_ = PacketSocket();
          if (bus_.wait(std::chrono::steady_clock::now() + kRefused, {&stop_fd_, 1}))
            return std::nullopt;
          break;
        case PacketSocket::Result::packet:
          if (!go_.ParseFromString(packet_) || go_.ended()) return std::nullopt;
          return begin();
      }
    }
  }

  void set_next(Time time) override {
    report_.set_next_ns(static_cast<std::uint64_t>(time.count()));
  }

  void done() override {
    bus_.flush(stop_fd_);
    report_.clear_published();
    for (v1::Publication& p : bus_.take_published()) *report_.add_published() = std::move(p);
    report_.set_step(report_.step() + 1);
    report_.SerializeToString(&packet_);
    report_.clear_next_ns();
    if (conductor_.valid() && !conductor_.send(packet_)) conductor_ = PacketSocket();
  }

  Time now() const override { return time_; }

 private:
  Time begin() {
    if (go_.generation() != generation_) {  // someone joined: let it hear what this step says
      generation_ = go_.generation();
      bus_.connect_members();
    }
    time_ = Time(static_cast<std::int64_t>(go_.time_ns()));
    bus_.deliver(time_, go_.visible(), stop_fd_);
    return time_;
  }

  /// False if the node shall stop instead.
  bool join() {
    bool said = false;
    const auto started = std::chrono::steady_clock::now();
    for (;;) {
      conductor_ = PacketSocket::connect(bus_.directory() + "/clock.sock");
      if (conductor_.valid()) {
        join_.set_resume_ns(static_cast<std::uint64_t>(time_.count()));
        join_.clear_published();
        for (v1::Publication& p : bus_.take_published()) *join_.add_published() = std::move(p);
        if (conductor_.send(join_.SerializeAsString())) return true;
      }
      if (!said && std::chrono::steady_clock::now() - started > 1s) {
        said = true;
        info("waits for the clock (node mimesis_clock)");
      }
      const std::array<int, 1> stop{stop_fd_};
      if (bus_.wait(std::chrono::steady_clock::now() + 5ms, stop)) return false;
    }
  }

  ZmqBus& bus_;
  int stop_fd_;
  PacketSocket conductor_;
  v1::LockstepJoin join_;
  v1::StepGo go_;
  v1::StepReport report_;
  std::string packet_;
  Time time_{};
  std::uint64_t generation_ = 0;
  Throttle gone_{1s};
};

}  // namespace

void add_clock_wiring(BusOptions& options) {
  if (options.clock == ClockKind::sim) options.in.emplace(kPort, "clock/time");
}

std::unique_ptr<NodeClock> make_clock(ClockKind kind, ZmqBus& bus, double rate_hz, double offset_s,
                                      int stop_fd) {
  switch (kind) {
    case ClockKind::wall:
      return std::make_unique<WallClock>(bus, rate_hz, offset_s, stop_fd);
    case ClockKind::sim:
      return std::make_unique<SimClock>(bus, rate_hz, offset_s, stop_fd);
    case ClockKind::lockstep:
      return std::make_unique<LockstepClock>(bus, rate_hz, offset_s, stop_fd);
  }
  return nullptr;
}

}  // namespace mimesis::runtime
