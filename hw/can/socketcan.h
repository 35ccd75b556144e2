#pragma once
#include <string>

#include "hw/can/bus.h"

namespace mimesis::hw::can {

/// The kernel's CAN (AF_CAN, SOCK_RAW) on one interface, error frames included. One system call per
/// batch.
class SocketCan final : public Bus {
 public:
  /// @throws ConfigError if the kernel has no CAN, or the interface is missing or down
  explicit SocketCan(const std::string& interface);
  ~SocketCan() override;
  SocketCan(const SocketCan&) = delete;
  SocketCan& operator=(const SocketCan&) = delete;

  void send(std::span<const Frame> frames) override;
  std::size_t receive(std::span<Frame> frames) override;

 private:
  int socket_ = -1;
};

}  // namespace mimesis::hw::can
