#pragma once
#include <chrono>
#include <cstdint>
#include <map>
#include <set>
#include <string>

#include "common/runtime/wire.h"
#include "common/runtime/zmq_socket.h"

namespace mimesis::runtime {

struct Incoming {
  WireMessage message;  ///< points into `header`
  Frame header, payload;
};

/// Receiving socket: subscriptions, and connections by the publisher's start_id.
class SubSocket {
 public:
  /// `start_id`: own, for the greeting.
  SubSocket(ZmqContext& context, int high_water_messages, std::uint64_t start_id);

  void subscribe(const std::string& topic);  ///< idempotent
  void connect(std::uint64_t publisher, const std::string& endpoint);
  /// The publisher is gone. The connection is closed a little later: its last words may be on their
  /// way.
  void retire(std::uint64_t publisher);
  bool connected(std::uint64_t publisher) const { return endpoints_.contains(publisher); }

  /// Next well-formed message; false if none is there now.
  bool receive(Incoming& incoming);
  std::uint64_t malformed() const { return malformed_; }
  void* handle() const { return socket_.handle(); }

 private:
  using Clock = std::chrono::steady_clock;
  void disconnect_retired();

  ZmqSocket socket_;
  std::set<std::string> topics_;
  std::map<std::uint64_t, std::string> endpoints_;      ///< by start_id
  std::map<std::uint64_t, Clock::time_point> retired_;  ///< start_id -> when to disconnect
  std::uint64_t malformed_ = 0;
};

}  // namespace mimesis::runtime
