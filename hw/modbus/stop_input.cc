#include "hw/modbus/stop_input.h"

#include <cerrno>

#include "hw/modbus/connection.h"

namespace mimesis::hw::modbus {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPeriod(20), kRetryPeriod(100);
constexpr milliseconds kLongestSilence(150);

}  // namespace

StopInput::StopInput(Address address, int unit, int input, bool threaded, milliseconds timeout)
    : address_(std::move(address)),
      unit_(unit),
      input_(input),
      threaded_(threaded),
      timeout_(timeout) {
  if (threaded_) thread_ = std::thread([this] { work(); });
}

StopInput::~StopInput() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
}

StopInput::Answer StopInput::ask() {
  if (!connection_) {
    auto opened = Connection::open(address_, unit_, timeout_);
    if (!opened) return {opened.error().reason, Clock::now()};
    connection_ = std::move(*opened);
  }
  std::uint8_t closed = 0;
  if (modbus_read_input_bits(connection_->context(), input_, 1, &closed) == 1)
    return {closed != 0 ? "" : "is open", Clock::now()};
  const std::string why = modbus_strerror(errno);
  connection_.reset();
  return {why, Clock::now()};
}

void StopInput::work() {
  while (!stopping_) {
    answers_.put(ask());
    std::this_thread::sleep_for(connection_ ? kPeriod : kRetryPeriod);
  }
}

std::string StopInput::open() {
  if (threaded_) {
    answers_.take(last_);
    const bool silent = last_.why.empty() && Clock::now() - last_.at > kLongestSilence;
    if (silent) last_.why = "does not answer";
  } else {
    last_ = ask();
  }
  if (last_.why.empty()) return {};
  return "input " + std::to_string(input_) + " at " + address_.text + ": " + last_.why;
}

}  // namespace mimesis::hw::modbus
