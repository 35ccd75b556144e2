#pragma once
#include <string>

#include "common/runtime/run_node.h"
#include "common/runtime/zmq_bus.h"

namespace google::protobuf {
class MessageLite;
}

namespace mimesis::runtime {

/// Runs `node` step by step as the process at the other end of the stream socket `fd` says
/// (v1.ReplayStep in, v1.ReplayOutcome out). Returns the exit code: 0 at the end of the stream.
int run_replay(const BusOptions& options, int fd, AnyNode& node);

/// A message on such a stream: its length (32 bits, little-endian), then its bytes. False: the
/// other end is gone.
bool write_packet(int fd, const google::protobuf::MessageLite& message);
/// False at the end of the stream, or if what arrives is no such message.
bool read_packet(int fd, google::protobuf::MessageLite& message);

}  // namespace mimesis::runtime
