#include "hw/modbus/connection.h"

#include <fmt/core.h>
#include <modbus/modbus.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace mimesis::hw::modbus {
namespace {

using std::chrono::milliseconds;
using WallClock = std::chrono::steady_clock;
using Bytes = Connection::Bytes;

const char* exception_text(int code) {
  constexpr std::array kTexts = {"illegal function", "illegal data address", "illegal data value",
                                 "device failure"};
  const bool known = code >= 1 && code <= static_cast<int>(kTexts.size());
  return known ? kTexts.at(static_cast<std::size_t>(code - 1)) : "refused";
}

std::uint8_t high(int word) { return static_cast<std::uint8_t>(word >> 8 & 0xFF); }
std::uint8_t low(int word) { return static_cast<std::uint8_t>(word & 0xFF); }

tl::unexpected<Status> failed(const std::string& why) { return tl::unexpected(Status{why}); }

/// [Modbus Messaging on TCP/IP 1.0b, 3.1.3]: transaction, protocol 0, bytes that follow, unit.
class Stream final : public Connection {
 public:
  Stream(int socket, int unit, milliseconds timeout) : Connection(unit, timeout), socket_(socket) {}
  ~Stream() override { close(socket_); }

 private:
  static constexpr std::size_t kHead = 7, kMost = 260;

  tl::expected<Bytes, Status> exchange(std::span<const std::uint8_t> request) override {
    const auto deadline = WallClock::now() + timeout_;
    ++transaction_;
    const int bytes = static_cast<int>(request.size()) + 1;
    Bytes frame = {high(transaction_), low(transaction_), 0,         0,
                   high(bytes),        low(bytes),        low(unit_)};
    frame.insert(frame.end(), request.begin(), request.end());
    if (send(socket_, frame.data(), frame.size(), MSG_NOSIGNAL) != std::ssize(frame))
      return failed(std::strerror(errno));
    for (int others = 0;;) {
      while (inbox_.size() >= kHead) {
        const std::size_t whole = 6 + 256 * std::size_t{inbox_[4]} + std::size_t{inbox_[5]};
        if (inbox_[2] != 0 || inbox_[3] != 0 || whole <= kHead || whole > kMost)
          return failed("the answer is no Modbus");
        if (inbox_.size() < whole) break;
        const auto end = inbox_.begin() + static_cast<std::ptrdiff_t>(whole);
        const bool ours = inbox_[0] == frame[0] && inbox_[1] == frame[1] && inbox_[6] == frame[6];
        const Bytes answer(inbox_.begin() + kHead, end);
        inbox_.erase(inbox_.begin(), end);
        if (ours) return answer;
        ++others;
      }
      const auto left = std::chrono::ceil<milliseconds>(deadline - WallClock::now());
      pollfd waiting{.fd = socket_, .events = POLLIN, .revents = 0};
      if (left.count() <= 0 || poll(&waiting, 1, static_cast<int>(left.count())) <= 0)
        return tl::unexpected(silence(others));
      std::array<std::uint8_t, kMost> part;
      const ssize_t n = recv(socket_, part.data(), part.size(), MSG_DONTWAIT);
      if (n == 0) return failed("the connection was closed");
      if (n < 0) return failed(std::strerror(errno));
      inbox_.insert(inbox_.end(), part.begin(), part.begin() + n);
    }
  }

  int socket_;
  std::uint16_t transaction_ = 0;
  Bytes inbox_;
};

/// A serial line, by libmodbus. What came before a request is dropped with it.
class Serial final : public Connection {
 public:
  Serial(modbus_t* made, int unit, milliseconds timeout)
      : Connection(unit, timeout), context_(made, &modbus_free) {
    MIMESIS_ASSERT(context_ != nullptr);
    modbus_set_slave(context_.get(), unit);
    Serial::set_timeout(timeout);
  }
  ~Serial() override { modbus_close(context_.get()); }
  bool connect() { return modbus_connect(context_.get()) == 0; }

  void set_timeout(milliseconds timeout) override {
    Connection::set_timeout(timeout);
    const auto microseconds = static_cast<std::uint32_t>(timeout.count() % 1000 * 1000);
    const auto whole = static_cast<std::uint32_t>(timeout.count() / 1000);
    modbus_set_response_timeout(context_.get(), whole, microseconds);
    modbus_set_byte_timeout(context_.get(), whole, microseconds);
  }

 private:
  tl::expected<Bytes, Status> exchange(std::span<const std::uint8_t> request) override {
    Bytes frame = {low(unit_)};
    frame.insert(frame.end(), request.begin(), request.end());
    const auto bytes = static_cast<int>(frame.size());
    modbus_flush(context_.get());
    std::array<std::uint8_t, MODBUS_RTU_MAX_ADU_LENGTH> answer;
    int length = modbus_send_raw_request(context_.get(), frame.data(), bytes);
    if (length > 0) length = modbus_receive_confirmation(context_.get(), answer.data());
    if (length < 0 && errno == ETIMEDOUT) return tl::unexpected(silence(0));
    if (length < 0) return failed(modbus_strerror(errno));
    constexpr int kCheck = 2;  // bytes of the checksum, which holds
    if (length < 2 + kCheck || answer[0] != frame[0]) return failed("the answer is no Modbus");
    return Bytes(answer.begin() + 1, answer.begin() + length - kCheck);
  }

  std::unique_ptr<modbus_t, decltype(&modbus_free)> context_;
};

}  // namespace

tl::expected<std::unique_ptr<Connection>, Status> Connection::open(const Address& address, int unit,
                                                                   milliseconds timeout,
                                                                   const Line& line) {
  if (address.device.empty()) {
    const auto socket = connect(address, timeout);
    if (!socket) return tl::unexpected(socket.error());
    return std::make_unique<Stream>(*socket, unit, timeout);
  }
  auto serial = std::make_unique<Serial>(
      modbus_new_rtu(address.device.c_str(), line.baud_bit_s, line.parity, 8, 1), unit, timeout);
  if (serial->connect()) return serial;
  return failed(modbus_strerror(errno));
}

Status Connection::silence(int others) const {
  std::string text = fmt::format("no answer of unit {} within {} ms", unit_, timeout_.count());
  if (others > 0) text += fmt::format(", but {} to other requests", others);
  return Status{text};
}

tl::expected<Bytes, Status> Connection::ask(std::span<const std::uint8_t> request) {
  refused_ = false;
  auto answer = exchange(request);
  if (!answer) return answer;
  const int function = answer->front();
  if (function == request.front()) return answer;
  refused_ = true;
  if (function != (request.front() | 0x80) || answer->size() < 2)
    return failed(fmt::format("function {} was asked, {} has answered", request.front(), function));
  const int code = (*answer)[1];
  return failed(fmt::format("{} (exception {})", exception_text(code), code));
}

tl::expected<std::vector<std::uint16_t>, Status> Connection::read(int function, int address,
                                                                  int count) {
  const std::array<std::uint8_t, 5> request = {low(function), high(address), low(address),
                                               high(count), low(count)};
  const auto answer = ask(request);
  if (!answer) return tl::unexpected(answer.error());
  const auto bytes = static_cast<std::size_t>(2 * count);
  if (answer->size() != 2 + bytes || (*answer)[1] != bytes)
    return failed(fmt::format("{} registers were asked, {} bytes have come", count,
                              answer->size() - std::min<std::size_t>(answer->size(), 2)));
  std::vector<std::uint16_t> values;
  for (std::size_t i = 2; i < answer->size(); i += 2)
    values.push_back(static_cast<std::uint16_t>((*answer)[i] << 8 | (*answer)[i + 1]));
  return values;
}

tl::expected<void, Status> Connection::write(int address, std::span<const std::uint16_t> values) {
  const auto count = static_cast<int>(values.size());
  Bytes request = {16, high(address), low(address), high(count), low(count), low(2 * count)};
  for (const std::uint16_t value : values) {
    request.push_back(high(value));
    request.push_back(low(value));
  }
  const auto answer = ask(request);
  if (!answer) return tl::unexpected(answer.error());
  if (!std::equal(answer->begin(), answer->end(), request.begin(), request.begin() + 5))
    return failed("the answer to a write is to another one");
  return {};
}

}  // namespace mimesis::hw::modbus
