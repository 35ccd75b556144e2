#pragma once
#include <memory>

#include "hw/modbus/registers.h"
#include "hw/modbus/stream.h"

namespace mimesis::hw::sim {

/// Modbus TCP server of a hand on a thread of its own (libmodbus). What clients read changes only
/// in `exchange`, so that in lock-step the thread's timing shows nowhere.
class HandServer {
 public:
  /// @throws ConfigError if the address cannot be served
  explicit HandServer(const modbus::Address& address);
  ~HandServer();
  HandServer(const HandServer&) = delete;
  HandServer& operator=(const HandServer&) = delete;

  /// Shows `input` from now on; returns what clients have written last.
  modbus::HandOutput exchange(const modbus::HandInput& input);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mimesis::hw::sim
