#include "hw/modbus/hand_driver.h"

#include <algorithm>
#include <cmath>

namespace mimesis::hw::modbus {
namespace {

std::uint8_t to_byte(double fraction) {
  return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(fraction, 0.0, 1.0)));
}

}  // namespace

HandOutput to_output(const HandSetpoint& setpoint, const HandInput& last) {
  const bool ready = last.initialisation == Initialisation::done ||
                     last.initialisation == Initialisation::changing_mode;
  return {.activate = !needs_reactivation(last.fault),
          .mode = setpoint.mode,
          .go = setpoint.move && ready,
          .position = to_byte(setpoint.closure),
          .speed = 255,
          .force = to_byte(setpoint.force)};
}

HandReading to_reading(const HandInput& input) {
  const bool ready = input.initialisation == Initialisation::done ||
                     input.initialisation == Initialisation::changing_mode;
  return {.active = input.activated && ready && input.fault == 0,
          .mode = input.mode,
          .closure = input.position / 255.0,
          .moving = (input.go && input.motion == Motion::moving) ||
                    input.initialisation == Initialisation::changing_mode,
          .object_detected = input.contact == Contact::while_closing,
          .fault = fault_text(input.fault)};
}

HandDriver::HandDriver(Address address, const Options& options)
    : client_(std::move(address), options.timeout), options_(options) {
  reading_.fault = "not connected yet";
  if (options_.threaded) thread_ = std::thread([this] { work(); });
}

HandDriver::~HandDriver() { stop(); }

void HandDriver::exchange_now(Time now, const HandSetpoint& setpoint, HandReading& reading) {
  if (const auto input = client_.exchange(now, to_output(setpoint, last_))) {
    last_ = *input;
    reading = to_reading(*input);
  } else {
    reading.active = reading.moving = false;
    reading.fault = input.error().reason;
  }
  reading.transactions = client_.transactions();
  reading.errors = client_.errors();
}

void HandDriver::work() {
  using Clock = std::chrono::steady_clock;
  HandSetpoint setpoint;
  HandReading reading;
  auto next = Clock::now();
  while (!stopping_.load(std::memory_order_relaxed)) {
    setpoints_.take(setpoint);
    exchange_now(Clock::now().time_since_epoch(), setpoint, reading);
    readings_.put(reading);
    next = std::max(next + options_.period, Clock::now());
    std::this_thread::sleep_until(next);
  }
}

const HandReading& HandDriver::exchange(Time now, const HandSetpoint& setpoint) {
  if (options_.threaded) {
    setpoints_.put(setpoint);
    readings_.take(reading_);
  } else {
    exchange_now(now, setpoint, reading_);
  }
  return reading_;
}

void HandDriver::stop() noexcept {
  try {
    if (stopping_.exchange(true)) return;
    if (thread_.joinable()) thread_.join();
    client_.exchange(Time::max() / 2, to_output({.mode = last_.mode}, last_));
  } catch (...) {  // the hand stands still by itself when nobody moves it
  }
}

}  // namespace mimesis::hw::modbus
