#include "hw/modbus/stop_input.h"

#include <array>

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
  const auto high = static_cast<std::uint8_t>(input_ >> 8), low = static_cast<std::uint8_t>(input_);
  const auto answer = connection_->ask(std::array<std::uint8_t, 5>{2, high, low, 0, 1});
  if (answer && answer->size() == 3 && (*answer)[1] == 1)
    return {((*answer)[2] & 1) != 0 ? "" : "is open", Clock::now()};
  const std::string why = answer ? "the answer is no input" : answer.error().reason;
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
