#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/runtime/sockets.h"
#include "common/runtime/wire.h"

namespace mimesis::runtime {

/// Sending half of a node: its data socket drops for slow subscribers and never blocks; its
/// reliable socket drops nothing: what does not fit waits here, up to a bound. Beyond it a
/// subscriber that takes nothing misses messages (counted), so that it can neither exhaust the
/// memory nor hold up the others.
class Publisher {
 public:
  /// One output; its owner only hands it back to `send`.
  struct Topic {
    struct Waiting {
      Frame header, payload;
      std::size_t size = 0;  ///< size of the payload, which sending takes away [bytes]
    };
    std::string frame;  ///< first frame, its header rewritten for every message
    std::uint64_t hash = 0, seq = 0;
    bool latched = false;
    bool overflowing = false;  ///< a subscriber is stuck: only what all the others take is kept
    std::size_t data_subscribers = 0, reliable_subscribers = 0;
    Waiting last;  ///< if latched and seq > 0
    std::deque<Waiting> waiting;
    std::size_t waiting_bytes = 0;
    std::chrono::steady_clock::time_point last_progress{};

    void pop();  ///< the oldest waiting
  };

  Publisher(ZmqContext& context, std::uint64_t start_id);

  ZmqSocket& data_socket() { return data_; }
  ZmqSocket& reliable_socket() { return reliable_; }

  /// Stable reference for the life of the publisher. Precondition: !has(topic).
  Topic& add(const std::string& topic, std::uint64_t type_hash, bool latched);
  bool has(const std::string& topic) const { return topics_.contains(topic); }

  /// Publishes; never blocks. Returns the message's seq.
  std::uint64_t send(Topic& topic, Frame payload, Time stamp, std::uint64_t tick);

  /// Late joiners get latched messages, waiting messages are tried again.
  void serve();
  /// Reliable messages are held back until this is called: subscribers are still connecting.
  void release();
  /// A reliable subscriber with this start_id is connected, its subscriptions are in force.
  bool greeted_by(std::uint64_t start_id) const { return greetings_.contains(start_id); }

  std::uint64_t sent() const { return sent_; }
  std::uint64_t backlog() const;
  std::uint64_t backlog_bytes() const;
  std::uint64_t overflow() const { return overflow_; }

  static std::uint64_t next_seq(const Topic& topic);
  static std::size_t subscribers(const Topic& topic);

 private:
  void on_subscription(std::string_view message, bool reliable);
  bool send_frames(ZmqSocket& socket, Frame& header, Frame& payload);
  void enqueue(Topic& topic, Frame header, Frame payload);
  void flush(Topic& topic);
  void force(Topic& topic);

  std::uint64_t start_id_;
  ZmqSocket data_, reliable_;
  std::map<std::string, std::unique_ptr<Topic>, std::less<>> topics_;
  std::unordered_map<std::uint64_t, int> greetings_;
  std::uint64_t sent_ = 0, overflow_ = 0;
  bool held_ = true;
};

}  // namespace mimesis::runtime
