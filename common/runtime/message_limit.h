#pragma once
#include <cstddef>
#include <cstdint>

#include "common/runtime/wire.h"

// libzmq bounds a frame (ZMQ_MAXMSGSIZE) but not a message, whose frames pile up unseen until it
// ends. So this library defines recv(), which libzmq calls, and follows the frames of each
// connection (ZMTP 3, RFC 37); one that exceeds a limit reads as closed by its peer. Frames behind
// a CURVE handshake are encrypted: hosts with trusted keys are bounded by ZMQ_MAXMSGSIZE alone.
namespace mimesis::runtime {

constexpr std::size_t kLargestWhole = kLargestMessage + (1U << 20U);  ///< message [bytes]
/// A command, or a frame of a peer that has not shown yet who it is [bytes].
constexpr std::size_t kLargestCommand = 64U << 10U;

/// Connections of this process that were cut.
struct Cut {
  std::uint64_t count = 0;
  int pid = 0;  ///< of the last one's other end; 0: it came by tcp
};
Cut cut_connections();

}  // namespace mimesis::runtime
