#include <array>

#include "common/runtime/node_clock.h"
#include "common/runtime/schedule.h"

namespace mimesis::runtime {
namespace {

using WallTime = ZmqBus::WallTime;

Time wall_now() { return std::chrono::system_clock::now().time_since_epoch(); }

class WallClock final : public NodeClock {
 public:
  WallClock(ZmqBus& bus, double rate_hz, double offset_s, int stop_fd)
      : bus_(bus),
        stop_({stop_fd}),
        // Whole seconds as the common origin keep the offsets between nodes.
        schedule_(rate_hz, offset_s, std::chrono::floor<std::chrono::seconds>(wall_now())) {
    schedule_.skip_past(wall_now());
  }

  std::optional<Time> wait() override {
    if (bus_.wait(WallTime(schedule_.due()), stop_)) return std::nullopt;
    bus_.drain();
    return wall_now();
  }

  void done() override {
    schedule_.advance();
    if (const Time t = wall_now(); t >= schedule_.due()) {
      ++overruns_;
      schedule_.skip_past(t);  // no burst of late steps
    }
  }
  Time now() const override { return wall_now(); }
  std::uint64_t overruns() const override { return overruns_; }

 private:
  ZmqBus& bus_;
  std::array<int, 1> stop_;
  Schedule schedule_;
  std::uint64_t overruns_ = 0;
};

}  // namespace

std::unique_ptr<NodeClock> make_wall_clock(ZmqBus& bus, double rate_hz, double offset_s,
                                           int stop_fd) {
  return std::make_unique<WallClock>(bus, rate_hz, offset_s, stop_fd);
}

}  // namespace mimesis::runtime
