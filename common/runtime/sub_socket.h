#pragma once
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "common/error.h"
#include "common/runtime/log.h"
#include "common/runtime/payload_memory.h"
#include "common/runtime/sockets.h"
#include "common/runtime/tcp_gate.h"
#include "common/runtime/wire.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {

struct Incoming {
  WireMessage message;  ///< points into `header`
  Frame header, payload;
  std::optional<PayloadPlace> place;  ///< of the payload, if it lies in the publisher's memory
};

/// Receiving socket: subscriptions, and connections by the publisher's start_id.
class SubSocket {
 public:
  /// `start_id`: own, for the greeting.
  SubSocket(ZmqContext& context, TcpGate& gate, int high_water_messages, std::uint64_t start_id)
      : gate_(gate), socket_(context, ZMQ_SUB) {
    socket_.set(ZMQ_RCVHWM, high_water_messages);
    socket_.set(ZMQ_SUBSCRIBE, hello(start_id));
  }

  /// Idempotent.
  void subscribe(const std::string& topic) {
    if (topics_.insert(topic).second) socket_.set(ZMQ_SUBSCRIBE, subscription(topic));
  }
  void unsubscribe(const std::string& topic) {
    if (topics_.erase(topic) > 0) socket_.set(ZMQ_UNSUBSCRIBE, subscription(topic));
  }
  const std::set<std::string>& topics() const { return topics_; }
  void connect(const v1::NodeInfo& publisher, const std::string& endpoint) {
    retired_.erase(publisher.start_id());
    if (endpoints_.contains(publisher.start_id())) return;
    try {
      if (gate_.connect(socket_, endpoint, publisher.public_key()))
        endpoints_.emplace(publisher.start_id(), endpoint);
    } catch (const ConfigError& e) {  // another process wrote it
      warn("a node's entry in the graph: {}; its messages do not arrive", e.what());
    }
  }
  /// The publisher has ended. The connection is closed a little later, because its last messages
  /// may be in transit.
  void retire(std::uint64_t publisher) {
    if (endpoints_.contains(publisher)) retired_.emplace(publisher, Clock::now() + kLastWords);
  }
  /// Closes the connection to a publisher at once.
  void drop(std::uint64_t publisher) {
    retired_.erase(publisher);
    const auto it = endpoints_.find(publisher);
    if (it == endpoints_.end()) return;
    socket_.disconnect(it->second);
    endpoints_.erase(it);
  }

  /// Tells a publisher how many of its messages did not come.
  void tell_missed(std::uint64_t publisher, std::uint64_t messages) {
    const std::string telling = missed(publisher, messages);
    socket_.set(ZMQ_SUBSCRIBE, telling);
    socket_.set(ZMQ_UNSUBSCRIBE, telling);
  }

  /// Next well-formed message; false if there is none now.
  bool receive(Incoming& incoming) {
    while (socket_.receive_first(incoming.header)) {
      const auto message = decode_frame(incoming.header.view());
      if (!message || !incoming.header.more() || !socket_.receive(incoming.payload)) {
        ++malformed_;
        continue;
      }
      incoming.place.reset();
      if (incoming.payload.more()) {
        Frame place;
        if (socket_.receive(place) && !place.more()) incoming.place = decode_place(place.view());
        if (!incoming.place) {
          ++malformed_;
          continue;
        }
      }
      incoming.message = *message;
      return true;
    }
    if (!retired_.empty()) disconnect_retired();  // only now: what had arrived of them is read
    return false;
  }
  std::uint64_t malformed() const { return malformed_; }
  void* handle() const { return socket_.handle(); }

 private:
  static constexpr std::chrono::milliseconds kLastWords{200};
  using Clock = std::chrono::steady_clock;
  void disconnect_retired() {
    const auto now = Clock::now();
    std::erase_if(retired_, [&](const auto& entry) {
      if (now < entry.second) return false;
      const auto it = endpoints_.find(entry.first);
      socket_.disconnect(it->second);
      endpoints_.erase(it);
      return true;
    });
  }

  TcpGate& gate_;
  ZmqSocket socket_;
  std::set<std::string> topics_;
  std::map<std::uint64_t, std::string> endpoints_;      ///< by start_id
  std::map<std::uint64_t, Clock::time_point> retired_;  ///< start_id -> when to disconnect
  std::uint64_t malformed_ = 0;
};

}  // namespace mimesis::runtime
