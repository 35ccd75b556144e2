#include "hw/modbus/connection.h"

#include <cerrno>

namespace mimesis::hw::modbus {

using std::chrono::milliseconds;

Connection::Connection(modbus_t* made, int unit, milliseconds timeout)
    : context_(made, &modbus_free) {
  MIMESIS_ASSERT(context_ != nullptr);
  modbus_set_slave(context_.get(), unit);
  set_timeout(timeout);
}

tl::expected<std::unique_ptr<Connection>, Status> Connection::open(const Address& address, int unit,
                                                                   milliseconds timeout) {
  if (address.device.empty()) {
    const auto socket = connect(address, timeout);
    if (!socket) return tl::unexpected(socket.error());
    std::unique_ptr<Connection> tcp(new Connection(modbus_new_tcp(nullptr, 0), unit, timeout));
    modbus_set_socket(tcp->context(), *socket);
    return tcp;
  }
  std::unique_ptr<Connection> line(
      new Connection(modbus_new_rtu(address.device.c_str(), 115'200, 'N', 8, 1), unit, timeout));
  if (modbus_connect(line->context()) == 0) return line;
  return tl::unexpected(Status{modbus_strerror(errno)});
}

void Connection::set_timeout(milliseconds timeout) {
  const auto microseconds = static_cast<std::uint32_t>(timeout.count() % 1000 * 1000);
  const auto whole = static_cast<std::uint32_t>(timeout.count() / 1000);
  modbus_set_response_timeout(context_.get(), whole, microseconds);
  modbus_set_byte_timeout(context_.get(), whole, microseconds);
}

}  // namespace mimesis::hw::modbus
