#include <algorithm>
#include <array>

#include "common/runtime/log.h"
#include "common/runtime/node_clock.h"
#include "common/runtime/ports.h"
#include "common/runtime/schedule.h"

namespace mimesis::runtime {
namespace {

using namespace std::chrono_literals;
using WallTime = ZmqBus::WallTime;

constexpr std::string_view kPort = ".clock";  // begins with a dot: no port of a node's own
constexpr auto kLook = 20ms;                  // for news of the clock

Time wall_now() { return std::chrono::system_clock::now().time_since_epoch(); }

/// Simulated time runs on between the clock's messages: t = t₀ + factor·(wall − wall₀).
class SimClock final : public NodeClock {
 public:
  SimClock(ZmqBus& bus, double rate_hz, double offset_s, int stop_fd)
      : bus_(bus), rate_hz_(rate_hz), offset_s_(offset_s), stop_({stop_fd}), clock_(bus, kPort) {}

  std::optional<Time> wait() override {
    for (bool said = false;;) {
      bus_.drain();
      if (!follow()) return std::nullopt;
      const Time wall = wall_now();
      if (schedule_ && now() >= schedule_->due()) return now();
      Time until = wall + kLook;
      if (schedule_) until = std::min(until, wall_of(schedule_->due()));
      if (bus_.wait(WallTime(until), stop_)) return std::nullopt;
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
    return time_ + Time(std::llround(factor_ * static_cast<double>((wall_now() - wall_).count())));
  }
  std::uint64_t overruns() const override { return overruns_; }

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
  std::uint64_t overruns_ = 0;
};

}  // namespace

void add_clock_wiring(BusOptions& options) {
  if (options.clock == ClockKind::sim) options.in.emplace(kPort, "clock/time");
}

std::unique_ptr<NodeClock> make_sim_clock(ZmqBus& bus, double rate_hz, double offset_s,
                                          int stop_fd) {
  return std::make_unique<SimClock>(bus, rate_hz, offset_s, stop_fd);
}

}  // namespace mimesis::runtime
