#pragma once
#include <modbus/modbus.h>

#include <chrono>
#include <memory>
#include <tl/expected.hpp>

#include "common/error.h"
#include "hw/modbus/stream.h"

namespace mimesis::hw::modbus {

/// libmodbus on a connection that stands.
class Connection {
 public:
  /// At most `timeout` of wall time, as later each answer. @param unit of the server
  static tl::expected<std::unique_ptr<Connection>, Status> open(const Address& address, int unit,
                                                                std::chrono::milliseconds timeout);
  ~Connection() { modbus_close(context_.get()); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void set_timeout(std::chrono::milliseconds timeout);
  modbus_t* context() { return context_.get(); }

 private:
  Connection(modbus_t* made, int unit, std::chrono::milliseconds timeout);

  std::unique_ptr<modbus_t, decltype(&modbus_free)> context_;
};

}  // namespace mimesis::hw::modbus
