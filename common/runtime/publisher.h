#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/error.h"
#include "common/runtime/log.h"
#include "common/runtime/payload_memory.h"
#include "common/runtime/sockets.h"
#include "common/runtime/stopped_subscribers.h"
#include "common/runtime/tcp_gate.h"
#include "common/runtime/wire.h"

namespace mimesis::runtime {

/// Sending half of a node: its data socket drops for slow subscribers and never blocks; its
/// reliable socket drops nothing: what does not fit waits here, up to a bound. Beyond it a
/// subscriber that takes nothing misses messages (counted), so that it can neither exhaust the
/// memory nor hold up the others. One that a signal has stopped does so for 3 s.
class Publisher {
 public:
  /// One output; its owner only hands it back to `send`.
  struct Topic {
    struct Waiting {
      Frame header, payload;
      std::size_t size = 0;  ///< size of the payload, which sending takes away [bytes]
    };
    std::string name;
    std::string frame;  ///< first frame, its header rewritten for every message
    std::uint64_t hash = 0, seq = 0;
    bool latched = false;
    bool overflowing = false;  ///< a subscriber is stuck: only what all the others take is kept
    std::size_t data_subscribers = 0, reliable_subscribers = 0;
    std::set<int> data_processes;         ///< that have subscribed; of those that left, too
    std::size_t mapping_subscribers = 0;  ///< of data_subscribers, those that map `memory`
    PayloadMemory memory;                 ///< large payloads, if all data subscribers map it
    Waiting last;                         ///< if latched and seq > 0
    std::deque<Waiting> waiting;
    std::size_t waiting_bytes = 0;
    std::chrono::steady_clock::time_point last_progress{};

    void pop() {  ///< the oldest waiting
      waiting_bytes -= waiting.front().size;
      waiting.pop_front();
    }
  };

  Publisher(ZmqContext& context, std::uint64_t start_id)
      : start_id_(start_id), data_(context, ZMQ_XPUB), reliable_(context, ZMQ_XPUB) {
    for (ZmqSocket* socket : {&data_, &reliable_}) {
      socket->set(ZMQ_XPUB_VERBOSER, 1);
      socket->set(ZMQ_LINGER, kLinger_ms);
      socket->limit_frames(kLargestSubscription);
    }
    data_.set(ZMQ_SNDHWM, kDataHighWater);
    reliable_.set(ZMQ_SNDHWM, kReliableHighWater);
    reliable_.set(ZMQ_XPUB_NODROP, 1);
  }

  ZmqSocket& data_socket() { return data_; }
  ZmqSocket& reliable_socket() { return reliable_; }

  /// Stable reference for the life of the publisher. Precondition: !has(topic).
  Topic& add(const std::string& topic, std::uint64_t type_hash, bool latched) {
    auto [it, fresh] = topics_.emplace(topic, std::make_unique<Topic>());
    MIMESIS_ASSERT(fresh);
    it->second->name = topic;
    it->second->frame = encode_frame(topic, {});
    it->second->hash = type_hash;
    it->second->latched = latched;
    return *it->second;
  }
  bool has(const std::string& topic) const { return topics_.contains(topic); }
  /// Subscriptions of data that have come, to know that `map_for` is due.
  std::uint64_t data_subscriptions() const { return data_subscriptions_; }
  /// Processes that take large payloads from memory, by topic.
  void map_for(const std::map<std::string, std::vector<int>, std::less<>>& processes) {
    for (auto& [name, topic] : topics_) {
      const auto it = processes.find(name);
      const std::set<int>& heard = topic->data_processes;
      topic->mapping_subscribers = it == processes.end()
                                       ? 0
                                       : static_cast<std::size_t>(std::count_if(
                                             it->second.begin(), it->second.end(),
                                             [&](int pid) { return heard.contains(pid); }));
    }
  }

  /// Publishes; never blocks. Returns the message's seq, or 0: it is too large and counts as lost.
  std::uint64_t send(Topic& topic, Frame payload, Time stamp, std::uint64_t tick) {
    ++topic.seq;
    if (payload.size() > kLargestMessage) {
      ++overflow_;
      if (too_large_.pass()) {
        error("topic {}: a message of {} bytes is not sent, expected at most {}", topic.name,
              payload.size(), kLargestMessage);
      }
      return 0;
    }
    ++sent_;
    rewrite_header(topic.frame, {.seq = topic.seq,
                                 .stamp = stamp,
                                 .type_hash = topic.hash,
                                 .start_id = start_id_,
                                 .tick = tick});
    Frame header{std::string_view(topic.frame)};
    if (topic.latched) topic.last = {header.share(), payload.share(), payload.size()};
    send_data(topic, header, payload);
    enqueue(topic, std::move(header), std::move(payload));
    return topic.seq;
  }

  /// Late joiners get latched messages, waiting messages are tried again.
  void serve() {
    for (ZmqSocket* socket : {&data_, &reliable_}) {
      for (Frame message; socket->receive_first(message);) {
        limit_subscriptions(message);
        far_.note(message);
        if (socket == &reliable_) stopped_.note(message);
        on_subscription(message.view(), socket == &reliable_, message.peer_pid());
        refused_ += message.more() ? 1 : 0;  // a subscription has one frame
      }
    }
    bool others_wait = false;
    for (auto& [name, topic] : topics_) {
      if (!topic->waiting.empty()) flush(*topic);
      others_wait |= !topic->waiting.empty() && topic->reliable_subscribers > 1;
    }
    if (others_wait && !held_) cut_stopped();
  }
  /// Call while something waits: who was stopped by a signal is cut off after 3 s. One that nobody
  /// waits for keeps its messages, up to the bound.
  void cut_stopped() { stopped_.look(std::chrono::steady_clock::now()); }
  /// Reliable messages are held back until this is called: subscribers are still connecting.
  void release() {
    held_ = false;
    serve();
  }
  /// Ends the connections of a host.
  void end_connections(const std::string& key) { far_.end(key); }
  /// A reliable subscriber with this start_id is connected, its subscriptions are in force.
  bool greeted_by(std::uint64_t start_id) const { return greetings_.contains(start_id); }

  std::uint64_t sent() const { return sent_; }
  std::uint64_t backlog() const {
    std::uint64_t n = 0;
    for (const auto& [name, topic] : topics_) n += topic->waiting.size();
    return n;
  }
  std::uint64_t backlog_bytes() const {
    std::uint64_t n = 0;
    for (const auto& [name, topic] : topics_) n += topic->waiting_bytes;
    return n;
  }
  /// Messages that stuck subscribers missed: exact once they read again, before from below.
  std::uint64_t overflow() const { return overflow_; }
  std::uint64_t refused() const { return refused_; }  ///< subscriptions beyond the limits

  static std::size_t subscribers(const Topic& topic) {
    return topic.data_subscribers + topic.reliable_subscribers;
  }

 private:
  // Messages per subscriber and side. Small: with 64 KiB messages a slow subscriber costs 4 MB, not
  // 130.
  static constexpr int kDataHighWater = 32;
  static constexpr int kReliableHighWater = 64;
  // Per topic; whichever is reached first.
  static constexpr std::size_t kBacklogMessages = 100'000;
  static constexpr std::size_t kBacklogBytes = std::size_t{128} << 20U;
  static constexpr std::size_t kLargestSubscription = 1024;
  // Of one process; a tool that follows 100 nodes of 15 topics subscribes to 40 KB.
  static constexpr std::size_t kMostSubscribedBytes = std::size_t{128} << 10U;
  // A subscriber that takes nothing for this long, once the bound was reached, is stuck.
  static constexpr std::chrono::milliseconds kStuck{500};
  // Long enough for the last words of a node that stops, short enough for one whose peer is stuck.
  static constexpr int kLinger_ms = 1000;

  /// ZeroMQ keeps every subscription, up to 200 bytes for each of its own, and knows no limit.
  /// Those that a connection takes back do not count: `missed` is one.
  void limit_subscriptions(Frame& message) {
    if (message.size() < 2) return;
    const int pid = message.peer_pid();
    std::size_t& bytes = subscribed_bytes_[pid];
    const std::pair key(message.connection(), std::string(message.view().substr(1)));
    if (message.view().substr(0, 1) != "\1") {
      if (subscriptions_.erase(key) > 0) bytes -= std::min(bytes, message.size());
      return;
    }
    if (subscriptions_.insert(key).second) bytes += message.size();
    if (bytes <= kMostSubscribedBytes) return;
    if (refused_++ == 0) {
      warn("{} subscribes to more than {} bytes of topics: its connections are closed",
           pid == 0 ? "tcp" : "process " + std::to_string(pid), kMostSubscribedBytes);
    }
    message.end_connection();
  }
  void on_subscription(std::string_view message, bool reliable, int pid) {
    if (message.size() < 2 || static_cast<unsigned char>(message.front()) > 1) return;
    const bool joined = message.front() == 1;
    message.remove_prefix(1);
    if (const auto start_id = decode_hello(message)) {
      if (reliable && (greetings_[*start_id] += joined ? 1 : -1) <= 0) greetings_.erase(*start_id);
      return;
    }
    if (const auto messages = decode_missed(message, start_id_)) {
      if (joined) count_missed(*messages);
      return;
    }
    message.remove_suffix(1);  // the NUL
    const auto it = topics_.find(message);
    if (it == topics_.end()) return;
    Topic& topic = *it->second;
    std::size_t& count = reliable ? topic.reliable_subscribers : topic.data_subscribers;
    if (!joined) {
      count -= std::min<std::size_t>(count, 1);
      if (topic.data_subscribers == 0) topic.data_processes.clear();
      return;
    }
    ++count;
    if (!reliable) {
      topic.data_processes.insert(pid);
      topic.mapping_subscribers = 0;
      ++data_subscriptions_;
    }
    if (!topic.latched || topic.seq == 0) return;
    // To all subscribers; those that have it already recognise its seq.
    Frame header = topic.last.header.share();
    Frame payload = topic.last.payload.share();
    if (!reliable) {
      send_data(topic, header, payload);
    } else if (topic.waiting.empty()) {  // else it comes anyway
      enqueue(topic, std::move(header), std::move(payload));
    }
  }
  /// A subscriber that takes its time keeps no copy of a large payload, only its place. One that
  /// cannot map makes all get copies.
  void send_data(Topic& topic, const Frame& header, const Frame& payload) {
    if (topic.data_subscribers == 0) return;
    Frame first = header.share();
    Frame second = payload.share();
    if (payload.size() >= kMappedPayload && topic.data_subscribers == topic.mapping_subscribers) {
      if (const auto place = topic.memory.write(second.view())) {
        Frame nothing, third{std::string_view(encode(*place))};
        if (data_.send(first, true) && data_.send(nothing, true)) data_.send(third, false);
        return;
      }
    }
    send_frames(data_, first, second);
  }
  bool send_frames(ZmqSocket& socket, Frame& header, Frame& payload) {
    // XPUB decides on the first frame for the whole message.
    return socket.send(header, true) && socket.send(payload, false);
  }
  void enqueue(Topic& topic, Frame header, Frame payload) {
    if (!held_ && topic.waiting.empty() && send_frames(reliable_, header, payload)) {
      topic.overflowing = false;
      return;
    }
    topic.waiting_bytes += payload.size();
    const std::size_t size = payload.size();
    topic.waiting.push_back({std::move(header), std::move(payload), size});
    flush(topic);
  }
  void flush(Topic& topic) {
    const auto full = [&topic] {
      return topic.waiting.size() > kBacklogMessages || topic.waiting_bytes > kBacklogBytes;
    };
    const auto now = std::chrono::steady_clock::now();
    for (;;) {
      while (!held_ && !topic.waiting.empty() &&
             send_frames(reliable_, topic.waiting.front().header, topic.waiting.front().payload)) {
        topic.pop();
        topic.last_progress = now;
      }
      if (topic.waiting.empty()) topic.overflowing = false;
      if (full()) topic.overflowing = true;
      if (!topic.overflowing || (!full() && now - topic.last_progress < kStuck)) return;
      force(topic);
      topic.last_progress = now;
    }
  }
  /// A subscriber reads again and tells what it has missed: the forced messages, which are counted,
  /// and all that the others got after them.
  void count_missed(std::uint64_t messages) {
    const std::uint64_t counted = std::min(messages, forced_);
    forced_ -= counted;
    overflow_ += messages - counted;
  }
  void force(Topic& topic) {
    // Without NODROP the socket delivers to all that have room, and from then on does not ask those
    // that had none until they have read something: one message frees the way for the others.
    ++overflow_;
    if (!held_) {
      ++forced_;
      reliable_.set(ZMQ_XPUB_NODROP, 0);
      send_frames(reliable_, topic.waiting.front().header, topic.waiting.front().payload);
      reliable_.set(ZMQ_XPUB_NODROP, 1);
    }
    topic.pop();
  }

  std::uint64_t start_id_;
  ZmqSocket data_, reliable_;
  FarConnections far_;
  StoppedSubscribers stopped_;
  std::map<std::string, std::unique_ptr<Topic>, std::less<>> topics_;
  std::unordered_map<std::uint64_t, int> greetings_;
  std::set<std::pair<int, std::string>> subscriptions_;    ///< by connection, which may have ended
  std::unordered_map<int, std::size_t> subscribed_bytes_;  ///< by process; 0: tcp
  Throttle too_large_{std::chrono::seconds(1)};
  std::uint64_t sent_ = 0, overflow_ = 0, refused_ = 0, data_subscriptions_ = 0;
  std::uint64_t forced_ = 0;  ///< counted in `overflow_`, and told by no subscriber yet
  bool held_ = true;
};

}  // namespace mimesis::runtime
