#include "hw/outside/recorded.h"

#include <csignal>
#include <stdexcept>
#include <utility>

#include "common/log/wire.h"

namespace mimesis::hw::outside {
namespace {

constexpr std::string_view kCan = "can";

/// Result of sending a batch.
struct Outcome {
  std::uint32_t taken = 0, errors = 0;
};

void put(log::Encoder& out, std::span<const can::Frame> frames) {
  out.integer(static_cast<std::uint32_t>(frames.size()));
  for (const can::Frame& frame : frames) {
    out.integer(frame.id);
    out.integer(frame.length);
    out.integer(frame.flags);
    out.raw({reinterpret_cast<const char*>(frame.data.data()), frame.length});
  }
}

/// False if that is no frame of this layout.
bool get(log::Decoder& in, can::Frame& frame) {
  frame = {};
  frame.id = in.integer<std::uint32_t>();
  frame.length = in.integer<std::uint8_t>();
  frame.flags = in.integer<std::uint8_t>();
  if (frame.length > frame.data.size()) return false;
  const std::string_view data = in.raw(frame.length);
  std::copy(data.begin(), data.end(), frame.data.begin());
  return in.ok();
}

class RecordedCan final : public can::Bus {
 public:
  RecordedCan(std::unique_ptr<can::Bus> wire, runtime::Bus& graph)
      : wire_(std::move(wire)), graph_(graph) {}

  void send(std::span<const can::Frame> frames) override {
    std::string bytes;
    log::Encoder out(bytes);
    put(out, frames);
    graph_.outside().written(kCan, bytes);
    const auto outcome = runtime::read_outside_value<Outcome>(graph_, kCan, [&] {
      const Traffic before = wire_->counters();
      wire_->send(frames);
      return Outcome{static_cast<std::uint32_t>(wire_->counters().sent - before.sent),
                     static_cast<std::uint32_t>(wire_->counters().errors - before.errors)};
    });
    counters_.sent += outcome.taken;
    counters_.errors += outcome.errors;
  }

  void want(std::span<const can::Wanted> wanted) override {
    if (wire_) wire_->want(wanted);
  }

  std::size_t receive(std::span<can::Frame> frames) override {
    return take(runtime::read_outside(graph_, kCan, [&] { return hear(frames); }), frames);
  }

 private:
  std::string hear(std::span<can::Frame> room) {
    const std::uint64_t before = wire_->counters().errors;
    const std::size_t count = wire_->receive(room);
    std::string bytes;
    log::Encoder out(bytes);
    out.integer(static_cast<std::uint32_t>(wire_->counters().errors - before));
    put(out, room.first(count));
    return bytes;
  }

  std::size_t take(std::string_view heard, std::span<can::Frame> frames) {
    if (heard.empty()) return 0;  // a replay that has ended
    log::Decoder in(heard);
    const auto errors = in.integer<std::uint32_t>();
    const auto count = in.integer<std::uint32_t>();
    bool good = in.ok() && count <= frames.size();
    for (std::size_t i = 0; good && i < count; ++i) {
      good = get(in, frames[i]);
      counters_.received += (frames[i].id & can::kErrorFlag) != 0 ? 0 : 1;
    }
    if (!good || !in.rest().empty()) {
      throw std::runtime_error("recorded 'can': " + std::to_string(heard.size()) +
                               " bytes are no frames, see hw/outside/recorded.h");
    }
    counters_.errors += errors;
    return count;
  }

  std::unique_ptr<can::Bus> wire_;
  runtime::Bus& graph_;
};

constexpr std::string_view kHand = "hand";

std::string encode(const modbus::HandSetpoint& setpoint) {
  std::string bytes;
  log::Encoder out(bytes);
  out.integer(static_cast<std::uint8_t>(setpoint.move));
  out.integer(setpoint.mode);
  out.integer(setpoint.closure);
  out.integer(setpoint.force);
  return bytes;
}

std::string encode(const modbus::HandReading& reading) {
  std::string bytes;
  log::Encoder out(bytes);
  out.integer(static_cast<std::uint8_t>((reading.active ? 1 : 0) | (reading.moving ? 2 : 0) |
                                        (reading.object_detected ? 4 : 0)));
  out.integer(reading.mode);
  out.integer(reading.closure);
  out.integer(reading.transactions);
  out.integer(reading.errors);
  out.raw(reading.fault);
  return bytes;
}

modbus::HandReading decode(std::string_view bytes) {
  log::Decoder in(bytes);
  modbus::HandReading reading;
  const auto flags = in.integer<std::uint8_t>();
  reading.active = (flags & 1) != 0;
  reading.moving = (flags & 2) != 0;
  reading.object_detected = (flags & 4) != 0;
  reading.mode = in.integer<modbus::HandMode>();
  reading.closure = in.integer<double>();
  reading.transactions = in.integer<std::uint64_t>();
  reading.errors = in.integer<std::uint64_t>();
  reading.fault = in.rest();
  if (!in.ok()) {
    throw std::runtime_error("recorded 'hand': " + std::to_string(bytes.size()) +
                             " bytes are no reading, see hw/outside/recorded.h");
  }
  return reading;
}

}  // namespace

std::unique_ptr<can::Bus> record_can(std::unique_ptr<can::Bus> wire, runtime::Bus& graph) {
  return std::make_unique<RecordedCan>(std::move(wire), graph);
}

std::unique_ptr<can::Bus> open_can(const std::string& address, runtime::Bus& graph,
                                   const std::string& role, const std::string& of) {
  can::check_address(address);
  graph.outside().opens({std::string(kCan), address, role, of});
  const bool live = !graph.outside().replaying();
  return record_can(live ? can::open(address, graph.directory()) : nullptr, graph);
}

RecordedHand::RecordedHand(const std::string& address, const modbus::HandProfile& profile,
                           const modbus::HandDriver::Options& options, runtime::Bus& graph)
    : graph_(graph) {
  const modbus::Address server = modbus::parse_address(address, graph.directory());
  graph.outside().opens({.kind = std::string(kHand), .address = address});
  if (graph.outside().replaying()) return;
  driver_ = std::make_unique<modbus::HandDriver>(server, profile, options);
}

const modbus::HandReading& RecordedHand::exchange(Time now, const modbus::HandSetpoint& setpoint) {
  graph_.outside().written(kHand, encode(setpoint));
  const std::string bytes = runtime::read_outside(
      graph_, kHand, [&] { return encode(driver_->exchange(now, setpoint)); });
  if (!bytes.empty()) reading_ = decode(bytes);  // empty: a replay that has ended
  return reading_;
}

void RecordedHand::stop() noexcept {
  try {
    graph_.outside().written(kHand, encode(modbus::HandSetpoint{}));
  } catch (...) {  // nothing keeps a hand from standing still
  }
  if (driver_) driver_->stop();
}

namespace {

constexpr std::string_view kUdp = "udp";

class RecordedLink final : public udp::Link {
 public:
  RecordedLink(std::unique_ptr<udp::Link> link, runtime::Bus& graph)
      : link_(std::move(link)), graph_(graph) {}

  bool send(std::string_view datagram) override {
    graph_.outside().written(kUdp, datagram);
    return runtime::read_outside_value<std::uint8_t>(
               graph_, kUdp, [&] { return static_cast<std::uint8_t>(link_->send(datagram)); }) != 0;
  }

  std::vector<std::string> receive() override {
    const std::string heard = runtime::read_outside(graph_, kUdp, [&] {
      std::string bytes;
      log::Encoder out(bytes);
      for (const std::string& datagram : link_->receive()) out.string(datagram);
      return bytes;
    });
    std::vector<std::string> all;
    for (log::Decoder in(heard); in.ok() && in.left() > 0;) all.emplace_back(in.string());
    return all;
  }

 private:
  std::unique_ptr<udp::Link> link_;
  runtime::Bus& graph_;
};

}  // namespace

std::unique_ptr<udp::Link> open_udp(const std::string& address, runtime::Bus& graph,
                                    const std::string& of) {
  udp::check_address(address);
  graph.outside().opens({std::string(kUdp), address, "master", of});
  const bool live = !graph.outside().replaying();
  return std::make_unique<RecordedLink>(live ? udp::connect(address) : nullptr, graph);
}

RecordedEndpoint::RecordedEndpoint(const std::string& address, runtime::Bus& graph,
                                   const std::string& of)
    : graph_(graph) {
  udp::check_address(address);
  graph.outside().opens({.kind = std::string(kUdp), .address = address, .of = of});
  if (!graph.outside().replaying()) endpoint_ = std::make_unique<udp::Endpoint>(address);
}

std::vector<udp::Endpoint::Datagram> RecordedEndpoint::receive() {
  const std::string heard = runtime::read_outside(graph_, kUdp, [&] {
    std::string bytes;
    log::Encoder out(bytes);
    for (const auto& [from, datagram] : endpoint_->receive()) {
      out.string(from);
      out.string(datagram);
    }
    return bytes;
  });
  std::vector<udp::Endpoint::Datagram> all;
  for (log::Decoder in(heard); in.ok() && in.left() > 0;) {
    std::string from(in.string());
    all.push_back({std::move(from), std::string(in.string())});
  }
  return all;
}

void RecordedEndpoint::send(const std::string& to, std::string_view bytes) {
  graph_.outside().written(kUdp, bytes);
  if (endpoint_) endpoint_->send(to, bytes);
}

namespace {

constexpr std::string_view kStop = "stop";
constexpr std::chrono::milliseconds kTimeout(50), kTimeoutLockstep(2000);

volatile std::sig_atomic_t stop_signalled = 0;

void on_stop_signal(int) { stop_signalled = 1; }

}  // namespace

StopInputs::StopInputs(const std::string& address, int unit, int input, runtime::Bus& graph)
    : graph_(graph) {
  const bool live = !graph.outside().replaying();
  if (live) {
    struct sigaction action {};
    action.sa_handler = on_stop_signal;
    action.sa_flags = SA_RESTART;
    sigaction(SIGUSR1, &action, nullptr);
  }
  if (address.empty()) return;
  const modbus::Address server = modbus::parse_address(address, graph.directory());
  graph.outside().opens({.kind = std::string(kStop), .address = address});
  const bool threaded = !graph.lockstep();
  if (live) {
    circuit_ = std::make_unique<modbus::StopInput>(server, unit, input, threaded,
                                                   threaded ? kTimeout : kTimeoutLockstep);
  }
}

StopInputs::~StopInputs() = default;

std::string StopInputs::demanded() {
  return runtime::read_outside(graph_, kStop, [this]() -> std::string {
    if (std::exchange(stop_signalled, 0) != 0) return "signal SIGUSR1";
    return circuit_ ? circuit_->open() : "";
  });
}

}  // namespace mimesis::hw::outside
