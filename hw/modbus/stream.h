#pragma once
#include <chrono>
#include <string>
#include <tl/expected.hpp>

#include "common/error.h"

namespace mimesis::hw::modbus {

/// Where a Modbus server is: tcp:HOST:PORT, unix:NAME, a stream socket in the graph's directory, or
/// rtu:DEVICE, a serial line of 115200 bit/s, 8N1.
struct Address {
  bool local = false;
  std::string device;  ///< serial line of an rtu address
  std::string host;    ///< host of a tcp address
  std::string port;    ///< port of a tcp address
  std::string path;    ///< path of a unix address
  std::string text;    ///< the address as written
};

/// @throws ConfigError if it is neither, or the socket's path is too long
Address parse_address(const std::string& text, const std::string& directory);

/// Connected socket, blocking; at most `timeout` of wall time. Not for a serial line.
tl::expected<int, Status> connect(const Address& address, std::chrono::milliseconds timeout);

/// Listening socket. @throws ConfigError if the address is in use or cannot be bound
int listen(const Address& address);

}  // namespace mimesis::hw::modbus
