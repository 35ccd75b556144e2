#include "hw/modbus/hand.h"

#include <algorithm>
#include <cerrno>
#include <cmath>

#include "hw/modbus/connection.h"

namespace mimesis::hw::modbus {
namespace {

using std::chrono::milliseconds;

constexpr Time kFirstPause = milliseconds(100), kLongestPause = milliseconds(2000);
constexpr milliseconds kLastTimeout(200);

std::uint8_t to_byte(double fraction) {
  return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(fraction, 0.0, 1.0)));
}

}  // namespace

HandClient::HandClient(Address address, milliseconds timeout)
    : address_(std::move(address)), timeout_(timeout), pause_(kFirstPause) {}

HandClient::~HandClient() = default;

void HandClient::hurry() {
  timeout_ = std::min(timeout_, kLastTimeout);
  if (connection_) connection_->set_timeout(timeout_);
}

tl::unexpected<Status> HandClient::fail(Time now, const std::string& why) {
  ++errors_;
  connection_.reset();
  retry_at_ = now + pause_;
  pause_ = std::min(2 * pause_, kLongestPause);
  last_failure_ = why;
  return tl::unexpected(Status{why});
}

tl::expected<HandInput, Status> HandClient::exchange(Time now, const HandOutput& output) {
  if (!connection_) {
    if (now < retry_at_) return tl::unexpected(Status{last_failure_});
    auto opened = Connection::open(address_, kUnit, timeout_);
    if (!opened) return fail(now, "hand at " + address_.text + ": " + opened.error().reason);
    connection_ = std::move(*opened);
    written_once_ = false;
  }
  modbus_t* context = connection_->context();
  constexpr int kCount = static_cast<int>(kRegisters);
  const auto failed = [&](const char* what) {
    return fail(now, "hand at " + address_.text + ": " + what + ": " + modbus_strerror(errno));
  };
  if (!written_once_ || output != written_) {
    const Registers registers = encode(output);
    if (modbus_write_registers(context, kOutputAddress, kCount, registers.data()) != kCount) {
      return failed("write");
    }
    ++transactions_;
    written_ = output;
    written_once_ = true;
  }
  Registers registers{};
  if (modbus_read_registers(context, kInputAddress, kCount, registers.data()) != kCount) {
    return failed("read");
  }
  ++transactions_;
  pause_ = kFirstPause;
  return decode_input(registers);
}

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
    client_.hurry();
    client_.exchange(Time::max() / 2, to_output({.mode = last_.mode}, last_));
  } catch (...) {  // the hand stands still by itself without commands
  }
}

}  // namespace mimesis::hw::modbus
