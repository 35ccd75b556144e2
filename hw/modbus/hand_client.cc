#include "hw/modbus/hand_client.h"

#include <modbus/modbus.h>

#include <algorithm>
#include <cerrno>

namespace mimesis::hw::modbus {
namespace {

using std::chrono::milliseconds;

constexpr Time kFirstPause = milliseconds(100), kLongestPause = milliseconds(2000);

struct Free {
  void operator()(modbus_t* context) const { modbus_free(context); }
};

}  // namespace

struct HandClient::Connection {
  Connection(int socket, milliseconds timeout) : context(modbus_new_tcp(nullptr, 0)) {
    MIMESIS_ASSERT(context != nullptr);
    const auto microseconds = static_cast<std::uint32_t>(timeout.count() % 1000 * 1000);
    const auto whole = static_cast<std::uint32_t>(timeout.count() / 1000);
    modbus_set_socket(context.get(), socket);
    modbus_set_slave(context.get(), kUnit);
    modbus_set_response_timeout(context.get(), whole, microseconds);
    modbus_set_byte_timeout(context.get(), whole, microseconds);
  }
  ~Connection() { modbus_close(context.get()); }

  std::unique_ptr<modbus_t, Free> context;
};

HandClient::HandClient(Address address, milliseconds timeout)
    : address_(std::move(address)), timeout_(timeout), pause_(kFirstPause) {}

HandClient::~HandClient() = default;

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
    const auto socket = connect(address_, timeout_);
    if (!socket) return fail(now, socket.error().reason);
    connection_ = std::make_unique<Connection>(*socket, timeout_);
    written_once_ = false;
  }
  modbus_t* context = connection_->context.get();
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

}  // namespace mimesis::hw::modbus
