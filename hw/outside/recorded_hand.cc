#include "hw/outside/recorded_hand.h"

#include <stdexcept>

#include "common/log/wire.h"
#include "common/runtime/outside.h"

namespace mimesis::hw::outside {
namespace {

constexpr std::string_view kName = "hand";

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
                             " bytes are no reading, see hw/outside/recorded_hand.h");
  }
  return reading;
}

}  // namespace

RecordedHand::RecordedHand(const std::string& address, const modbus::HandDriver::Options& options,
                           runtime::Bus& graph)
    : graph_(graph) {
  if (graph.outside().replaying()) return;
  driver_ = std::make_unique<modbus::HandDriver>(modbus::parse_address(address, graph.directory()),
                                                 options);
}

const modbus::HandReading& RecordedHand::exchange(Time now, const modbus::HandSetpoint& setpoint) {
  graph_.outside().written(kName, encode(setpoint));
  const std::string bytes = runtime::read_outside(
      graph_, kName, [&] { return encode(driver_->exchange(now, setpoint)); });
  if (!bytes.empty()) reading_ = decode(bytes);  // empty: a replay that has ended
  return reading_;
}

void RecordedHand::stop() noexcept {
  try {
    graph_.outside().written(kName, encode(modbus::HandSetpoint{}));
  } catch (...) {  // nothing keeps a hand from standing still
  }
  if (driver_) driver_->stop();
}

}  // namespace mimesis::hw::outside
