#include "hw/modbus/hand.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "hw/modbus/connection.h"

namespace mimesis::hw::modbus {
namespace {

using std::chrono::milliseconds;

constexpr Time kFirstPause = milliseconds(100), kLongestPause = milliseconds(2000);
constexpr milliseconds kLastTimeout(200);

}  // namespace

HandClient::HandClient(Address address, HandProfile profile, milliseconds timeout)
    : address_(std::move(address)),
      profile_(std::move(profile)),
      timeout_(timeout),
      pause_(kFirstPause) {}

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
  last_failure_ = "hand at " + address_.text + ": " + why;
  return tl::unexpected(Status{last_failure_});
}

/// A device that has never shown to be this hand, and refuses its registers or has no such unit,
/// may be another one.
std::string HandClient::blame(const RegisterBlock& block, const std::string& why) const {
  const std::string what =
      fmt::format("registers {} to {}: {}", block.address, block.address + block.count - 1, why);
  if (met_) return what;
  return what + (connection_->refused() ? ": this is no " : ": is it a ") + profile_.name +
         (connection_->refused() ? ", see parameter hand_profile" : "?");
}

std::string HandClient::read(const std::vector<RegisterBlock>& blocks) {
  for (const RegisterBlock& block : blocks) {
    const auto values = connection_->read(block.function, block.address, block.count);
    if (!values) return blame(block, values.error().reason);
    ++transactions_;
    for (int i = 0; i < block.count; ++i)
      image_[block.address + i] = (*values)[static_cast<std::size_t>(i)];
  }
  const std::string contrary = contradiction(profile_, image_);
  if (!contrary.empty()) return "is no " + profile_.name + ": " + contrary;
  proven_ = proven_ || proves(profile_, image_);
  return {};
}

std::string HandClient::write(const HandRegisters& registers) {
  for (const RegisterBlock& block : profile_.write) {
    std::vector<std::uint16_t> values;
    bool changed = false;
    for (int i = 0; i < block.count; ++i) {
      const std::uint16_t value = registers.at(block.address + i);
      const auto before = written_.find(block.address + i);
      changed = changed || before == written_.end() || before->second != value;
      values.push_back(value);
    }
    if (!changed) continue;
    if (const auto done = connection_->write(block.address, values); !done)
      return blame(block, done.error().reason);
    ++transactions_;
    for (int i = 0; i < block.count; ++i)
      written_[block.address + i] = values[static_cast<std::size_t>(i)];
  }
  return {};
}

/// Connects, and asks who is there before it writes anything.
std::string HandClient::open() {
  const Line line{.baud_bit_s = profile_.baud_bit_s,
                  .parity = profile_.parity == "even"  ? 'E'
                            : profile_.parity == "odd" ? 'O'
                                                       : 'N'};
  auto opened = Connection::open(address_, profile_.unit, timeout_, line);
  if (!opened) return opened.error().reason;
  connection_ = std::move(*opened);
  image_.clear();
  written_.clear();
  proven_ = false;
  if (std::string why = read(profile_.identify); !why.empty()) return why;
  return read(profile_.read);
}

tl::expected<HandReading, Status> HandClient::exchange(Time now, const HandSetpoint& setpoint) {
  if (!connection_) {
    if (now < retry_at_) return tl::unexpected(Status{last_failure_});
    if (const std::string why = open(); !why.empty()) return fail(now, why);
  }
  HandSetpoint wanted = setpoint;
  wanted.move = wanted.move && proven_;
  if (const std::string why = write(to_registers(profile_, wanted, image_)); !why.empty())
    return fail(now, why);
  if (const std::string why = read(profile_.read); !why.empty()) return fail(now, why);
  HandReading reading = to_reading(profile_, image_, setpoint.mode);
  if (proven_) {
    met_ = true;
    pause_ = kFirstPause;
    return reading;
  }
  if (is_ready(profile_, image_))
    return fail(now, "is no " + profile_.name + ": " + profile_.unproven);
  reading.active = reading.object_detected = false;
  return reading;
}

HandDriver::HandDriver(Address address, const HandProfile& profile, const Options& options)
    : client_(std::move(address), profile,
              options.timeout.count() > 0 ? options.timeout
                                          : milliseconds(std::lround(1e3 * profile.timeout_s))),
      options_(options) {
  reading_.fault = "not connected yet";
  if (options_.threaded) thread_ = std::thread([this] { work(); });
}

HandDriver::~HandDriver() { stop(); }

void HandDriver::exchange_now(Time now, const HandSetpoint& setpoint, HandReading& reading) {
  mode_ = setpoint.mode;
  if (auto read = client_.exchange(now, setpoint)) {
    reading = std::move(*read);
  } else {
    reading.active = reading.moving = false;
    reading.fault = read.error().reason;
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
    client_.exchange(Time::max() / 2, {.mode = mode_});
  } catch (...) {  // the hand stands still by itself without commands
  }
}

}  // namespace mimesis::hw::modbus
