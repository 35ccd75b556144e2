// The conductor's sockets: packets from and to the nodes, clock/time for observers.
#include <poll.h>

#include <cmath>
#include <optional>
#include <vector>

#include "common/runtime/conductor.h"
#include "common/runtime/log.h"
#include "common/runtime/ports.h"
#include "common/runtime/service_manager.h"
#include "common/runtime/sockets.h"
#include "nodes/clock/clock_node.h"

namespace mimesis::clock {
namespace {

using namespace std::chrono_literals;
using runtime::PacketSocket;
using runtime::Time;
using Wall = std::chrono::steady_clock;

constexpr auto kServePeriod = 5ms;     // period of serving the bus: discovery, late joiners
constexpr Time kPublishPeriod = 10ms;  // period of clock/time, in simulated time
constexpr auto kStopPatience = 2s;     // for nodes to stop after the end of time
constexpr auto kLong = 5s;             // a step that takes longer is reported
constexpr std::size_t kMostConnections = 512;

struct Connection {
  PacketSocket socket;
  std::uint64_t start_id = 0;  ///< 0 until it has joined
  std::string name;
};

class LockstepServer {
 public:
  LockstepServer(const ClockParams& params, runtime::ZmqBus& bus, int stop_fd)
      : params_(params),
        bus_(bus),
        stop_fd_(stop_fd),
        conductor_(params.participants,
                   params.until_s > 0.0 ? runtime::from_seconds(params.until_s) : Time::max()),
        out_(time_port(bus)),
        listener_(PacketSocket::listen(bus.directory() + "/clock.sock")) {}

  void run() {
    bus_.ready();
    runtime::notify_ready();
    while (wait_for_packets()) {
      accept();
      receive();
      while (!paced_until_ && start_steps()) receive();
    }
  }

 private:
  /// False at the end: asked to stop, or time is over and the nodes have gone.
  bool wait_for_packets() {
    if (const auto now = Wall::now(); now >= next_serve_) {
      bus_.wait(std::chrono::steady_clock::now());
      next_serve_ = now + kServePeriod;
      watch(now);
    }
    items_.assign({{stop_fd_, POLLIN, 0}, {listener_.fd(), POLLIN, 0}});
    for (const auto& connection : connections_)
      items_.push_back({connection.socket.fd(), POLLIN, 0});
    auto timeout = next_serve_;
    if (paced_until_) timeout = std::min(timeout, *paced_until_);
    const auto left =
        std::max(std::chrono::nanoseconds(timeout - Wall::now()), std::chrono::nanoseconds(0));
    const timespec ts{left.count() / 1'000'000'000, left.count() % 1'000'000'000};
    ppoll(items_.data(), items_.size(), &ts, nullptr);
    if (paced_until_ && Wall::now() >= *paced_until_) paced_until_.reset();
    if (ended_ && (connections_.empty() || Wall::now() > *ended_)) return false;
    return (items_[0].revents & POLLIN) == 0;
  }

  /// Names the nodes that time waits for, and leaves them out in the end.
  void watch(Wall::time_point now) {
    const auto patience = std::chrono::duration<double>(params_.patience_s);
    const bool out = now - began_ > patience;
    if (ended_ || !next_.empty() || !(out || (now - began_ > kLong && !said_late_))) return;
    said_late_ = true;
    std::erase_if(connections_, [&](const Connection& c) {
      if (!conductor_.awaits(c.start_id)) return false;
      runtime::warn("node {}: its step at {} s has not ended for {:.1f} s: {}", c.name,
                    runtime::to_seconds(conductor_.time()),
                    std::chrono::duration<double>(now - began_).count(),
                    out ? "it is left out" : "time waits for it");
      if (out) conductor_.leave(c.start_id);
      return out;
    });
  }

  void accept() {
    for (PacketSocket s = listener_.accept(); s.valid(); s = listener_.accept()) {
      if (connections_.size() < kMostConnections)
        connections_.push_back({.socket = std::move(s), .name = {}});
    }
  }

  void receive() {
    for (std::size_t i = 0; i < connections_.size();) {
      if (take_all(connections_[i])) {
        ++i;
        continue;
      }
      conductor_.leave(connections_[i].start_id);
      if (!ended_ && connections_[i].start_id != 0)
        runtime::info("node {} left", connections_[i].name);
      connections_.erase(connections_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }

  /// False if the node is gone.
  bool take_all(Connection& from) {
    for (;;) {
      switch (from.socket.receive(packet_)) {
        case PacketSocket::Result::nothing:
          return true;
        case PacketSocket::Result::closed:
          return false;
        case PacketSocket::Result::packet:
          break;
      }
      if (from.start_id == 0) {
        if (!join_.ParseFromString(packet_) || join_.start_id() == 0) return false;
        if (const std::string why = conductor_.join(join_); !why.empty()) {
          if (refusals_.pass()) runtime::warn("node {} may not join: {}", join_.node(), why);
          return false;
        }
        from.start_id = join_.start_id();
        from.name = join_.node();
        continue;
      }
      using enum runtime::Conductor::Reported;
      const auto how =
          report_.ParseFromString(packet_) ? conductor_.report(from.start_id, report_) : foreign;
      if (how == foreign) {
        runtime::warn("node {}: its report is none, or names messages of another node", from.name);
        return false;
      }
      if (how == hurried)
        runtime::warn(
            "node {} asks for steps that follow each other too fast: it gets 100 000 a second",
            from.name);
    }
  }

  /// True if steps were started and their reports may follow at once.
  bool start_steps() {
    const auto gos = next_.empty() ? conductor_.advance() : std::exchange(next_, {});
    if (gos.empty()) return false;
    if (conductor_.ended()) {
      publish(true);
      if (!ended_)
        runtime::info("simulated time ends at {} s", runtime::to_seconds(conductor_.time()));
      ended_ = Wall::now() + kStopPatience;
    } else if (hold_back()) {
      next_ = gos;
      return false;
    }
    began_ = Wall::now();
    said_late_ = false;
    for (const auto& go : gos) {
      for (const auto& connection : connections_) {
        if (connection.start_id != go.start_id) continue;
        go.message.SerializeToString(&packet_);
        connection.socket.send(packet_);  // a failure shows as a closed connection
      }
    }
    if (!ended_ && conductor_.time() >= next_publish_) publish(false);
    return false;
  }

  /// True while wall time is behind: t = factor·(wall − start).
  bool hold_back() {
    if (params_.factor <= 0.0) return false;
    const auto now = Wall::now();
    const auto scaled = [&](Time t) {
      return Time(std::llround(static_cast<double>(t.count()) / params_.factor));
    };
    if (!start_) start_ = now - scaled(conductor_.time());
    const auto due = *start_ + scaled(conductor_.time());
    if (now >= due) return false;
    paced_until_ = due;
    return true;
  }

  void publish(bool ended) {
    v1::ClockTime message;
    message.set_time_ns(static_cast<std::uint64_t>(conductor_.time().count()));
    message.set_wall_ns(static_cast<std::uint64_t>(bus_.time().now().count()));
    message.set_factor(params_.factor);
    message.set_ended(ended);
    out_.send(message, conductor_.time());
    next_publish_ = conductor_.time() + kPublishPeriod;
  }

  const ClockParams& params_;
  runtime::ZmqBus& bus_;
  int stop_fd_;
  runtime::Conductor conductor_;
  runtime::Out<v1::ClockTime> out_;
  PacketSocket listener_;
  std::vector<Connection> connections_;
  std::vector<pollfd> items_;
  std::vector<runtime::Conductor::Go> next_;  ///< held back by the pace
  std::optional<Wall::time_point> start_, paced_until_, ended_;
  Wall::time_point began_{};  ///< of the steps that run
  bool said_late_ = false;
  runtime::Throttle refusals_{1s};
  Wall::time_point next_serve_{};
  Time next_publish_{};
  std::string packet_;
  v1::LockstepJoin join_;
  v1::StepReport report_;
};

}  // namespace

void conduct(const ClockParams& params, runtime::ZmqBus& bus, int stop_fd) {
  LockstepServer(params, bus, stop_fd).run();
}

}  // namespace mimesis::clock
