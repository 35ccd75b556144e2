#include <array>

#include "common/error.h"
#include "common/runtime/log.h"
#include "common/runtime/node_clock.h"
#include "common/runtime/packet_socket.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {
namespace {

using namespace std::chrono_literals;

/// A participant of lock-step time: the conductor says when to step and what the step sees.
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
      if (!bus_.wait(std::chrono::system_clock::now() + 1h, fds)) continue;
      switch (conductor_.receive(packet_)) {
        case PacketSocket::Result::nothing:  // so it was the stop signal
          return std::nullopt;
        case PacketSocket::Result::closed:
          warn("the clock is gone; waiting for it");
          conductor_ = PacketSocket();
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
    bus_.flush();
    report_.clear_published();
    for (v1::Publication& p : bus_.take_published()) *report_.add_published() = std::move(p);
    report_.set_step(report_.step() + 1);
    report_.SerializeToString(&packet_);
    report_.clear_next_ns();
    if (conductor_.valid() && !conductor_.send(packet_)) conductor_ = PacketSocket();
  }

  Time now() const override { return time_; }
  std::uint64_t overruns() const override { return 0; }

 private:
  Time begin() {
    if (go_.generation() != generation_) {  // someone joined: let it hear what this step says
      generation_ = go_.generation();
      bus_.connect_members();
    }
    time_ = Time(static_cast<std::int64_t>(go_.time_ns()));
    bus_.deliver(time_, go_.visible());
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
      if (bus_.wait(std::chrono::system_clock::now() + 5ms, stop)) return false;
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
};

}  // namespace

std::unique_ptr<NodeClock> make_lockstep_clock(ZmqBus& bus, double rate_hz, double offset_s,
                                               int stop_fd) {
  return std::make_unique<LockstepClock>(bus, rate_hz, offset_s, stop_fd);
}

}  // namespace mimesis::runtime
