#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "hw/can/frame.h"

namespace mimesis::hw::can {

/// What happened on a bus since it was opened.
struct Counters {
  std::uint64_t sent = 0;      ///< frames taken by the wire
  std::uint64_t received = 0;  ///< frames, without error frames
  std::uint64_t errors = 0;    ///< frames not taken, and error frames
};

/// Moves frames, knows nothing of their meaning. Whoever is on the bus receives every frame but its
/// own.
class Bus {
 public:
  virtual ~Bus() = default;

  /// Hands frames to the wire in one batch. Never blocks and keeps nothing for later: what the wire
  /// does not take now is dropped and counted, so that no stale command waits in a queue of ours.
  virtual void send(std::span<const Frame> frames) = 0;

  /// Takes frames that have arrived, oldest first; never blocks. Error frames are among them.
  /// @return how many of `frames` were filled; if all, there may be more
  virtual std::size_t receive(std::span<Frame> frames) = 0;

  const Counters& counters() const { return counters_; }

 protected:
  Counters counters_;
};

/// Opens the bus at `address`:
///   embedded:NAME     Unix datagram sockets below `directory` (the graph's); no CAN in the kernel
///   needed socketcan:IFACE   the kernel's CAN interface
/// @throws ConfigError with one line: unknown kind, no such interface, interface down, no CAN in
/// the kernel
std::unique_ptr<Bus> open(const std::string& address, const std::string& directory);

}  // namespace mimesis::hw::can
