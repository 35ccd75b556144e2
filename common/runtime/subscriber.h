#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/runtime/bus.h"
#include "common/runtime/log.h"
#include "common/runtime/sub_socket.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {

/// How old messages were at the step that took them, of the newest since the last report.
class Latencies {
 public:
  void add(Time age) { ages_[taken_++ % ages_.size()] = age; }
  /// Writes median and 99th percentile, and begins anew.
  void report(v1::InputHealth& health) {
    const std::size_t n = std::min(std::exchange(taken_, 0), ages_.size());
    if (n == 0) return;
    std::sort(ages_.begin(), ages_.begin() + static_cast<std::ptrdiff_t>(n));
    health.set_latency_p50_s(to_seconds(ages_[(n - 1) / 2]));
    health.set_latency_p99_s(to_seconds(ages_[(n - 1) * 99 / 100]));
  }

 private:
  std::array<Time, 1024> ages_{};
  std::size_t taken_ = 0;
};

/// One input port: applies the policy, counts lost and dropped messages.
class Input {
 public:
  /// `owner`: name of the only node that it obeys; empty: any, or (Author::first) the one that it
  /// is given later.
  Input(std::string topic, std::uint64_t type_hash, const InOptions& options, std::string owner)
      : topic_(std::move(topic)),
        owner_(std::move(owner)),
        hash_(type_hash),
        options_(options),
        takes_first_(options.author == Author::first && owner_.empty()) {}

  const std::string& topic() const { return topic_; }
  /// The node does not work without it, and nothing has come yet.
  bool awaited() const { return !options_.optional && counters.received == 0; }
  std::uint64_t type_hash() const { return hash_; }
  Policy policy() const { return options_.policy; }

  const std::string& owner() const { return owner_; }
  /// The first publisher that is alive becomes its owner.
  bool takes_first() const { return takes_first_; }
  void set_owner(const std::string& node) { owner_ = node; }

  /// False for a repetition (of a latched message) and for a number far from the others, which are
  /// then ignored. Counts gaps.
  bool fresh(std::uint64_t start_id, std::uint64_t seq) {
    std::uint64_t lost = 0;
    const SeqOrder::Place place = order_[start_id].place(seq, lost);
    counters.lost += lost;
    if (place == SeqOrder::Place::far) ++counters.rejected;
    return place == SeqOrder::Place::next;
  }
  /// With `memory` the payload is read there when the message is taken.
  void push(Received message, std::shared_ptr<MappedPayloads> memory = nullptr,
            const PayloadPlace& place = {}) {
    ++counters.received;
    newest = message.stamp;
    pending_.push_back({std::move(message), std::move(memory), place});
    const std::size_t depth = options_.policy == Policy::latest  ? 1
                              : options_.policy == Policy::queue ? options_.depth
                                                                 : kReliableDepth;
    if (pending_.size() > depth) {
      pending_.pop_front();
      ++counters.dropped;
    }
  }
  /// `now`: time of the step; 0: there are none
  std::optional<Received> pop(Time now) {
    while (!pending_.empty()) {
      Pending next = std::move(pending_.front());
      pending_.pop_front();
      Received& message = next.message;
      if (next.memory != nullptr && !next.memory->read(next.place, message.payload)) {
        ++counters.dropped;  // overwritten: a newer one is on its way
        continue;
      }
      if (now != Time(0)) latencies_.add(now - message.stamp);
      return std::move(message);
    }
    return std::nullopt;
  }
  void report(Time now, v1::InputHealth& health) {
    health.set_topic(topic_);
    health.set_received(counters.received);
    health.set_lost(counters.lost);
    health.set_dropped(counters.dropped);
    health.set_rejected(counters.rejected);
    if (counters.received > 0) health.set_age_s(to_seconds(now - newest));
    latencies_.report(health);
    health.set_queued(pending_.size());
    if (!pending_.empty()) health.set_queue_age_s(to_seconds(now - pending_.front().message.stamp));
  }

  InCounters counters;
  Time newest{};  ///< stamp of the newest message received

 private:
  static constexpr std::size_t kReliableDepth = 200'000;  // of an input nobody reads

  struct Pending {
    Received message;
    std::shared_ptr<MappedPayloads> memory;  ///< null: the message holds its payload
    PayloadPlace place;
  };

  std::string topic_, owner_;
  std::uint64_t hash_;
  InOptions options_;
  bool takes_first_;
  std::deque<Pending> pending_;
  Latencies latencies_;
  std::map<std::uint64_t, SeqOrder> order_;  ///< by start_id
};

/// Receiving half of a node: `latest` and `queue` inputs on a lossy socket, `reliable` ones (in
/// lock-step: all) on a second one.
class Subscriber {
 public:
  Subscriber(ZmqContext& context, TcpGate& gate, std::uint64_t start_id, bool lockstep)
      : own_(start_id),
        data_(context, gate, kDataHighWater, start_id),
        reliable_(context, gate, kReliableHighWater, start_id),
        lockstep_(lockstep) {}

  std::shared_ptr<Input> add(const std::string& topic, std::uint64_t type_hash,
                             const InOptions& options, const std::string& owner) {
    auto input = std::make_shared<Input>(topic, type_hash, options, owner);
    inputs_[topic].push_back(input);
    (uses_reliable_socket(*input) ? reliable_ : data_).subscribe(topic);
    return input;
  }
  /// Connects to a node if one of its outputs is wired here.
  void meet(const v1::NodeInfo& node) {
    // By tcp only hosts are heard whose keys are trusted; their processes have no pid here.
    const bool far = !node.data_endpoints().empty() && node.data_endpoints(0).starts_with("tcp://");
    known_[node.start_id()] = {node.name(), node.clock() == "lockstep",
                               far ? 0 : static_cast<int>(node.pid())};
    current_[node.name()] = node.start_id();
    for (const v1::TopicInfo& output : node.outputs()) {
      const auto it = inputs_.find(output.topic());
      if (it == inputs_.end()) continue;
      for (const auto& input : it->second) {
        const bool reliable = uses_reliable_socket(*input);
        const auto& endpoints = reliable ? node.reliable_endpoints() : node.data_endpoints();
        if (!endpoints.empty()) (reliable ? reliable_ : data_).connect(node, endpoints[0]);
      }
    }
  }
  /// Hears the node no more.
  void drop(const v1::NodeInfo& node) {
    data_.drop(node.start_id());
    reliable_.drop(node.start_id());
    known_.erase(node.start_id());
  }
  void forget(const v1::NodeInfo& node) {
    const int pid = static_cast<int>(node.pid());
    std::erase_if(mapped_, [pid](const auto& one) { return one.first.first == pid; });
    data_.retire(node.start_id());
    reliable_.retire(node.start_id());
  }

  /// Moves what has arrived to the inputs; in lock-step only from nodes that do not take part in
  /// it, the rest is kept for `deliver`. True if anything arrived.
  bool drain() {
    const bool data = drain(data_, false);
    return drain(reliable_, true) || data;
  }
  /// Lock-step: moves one message to its inputs; false if it has not arrived yet.
  bool deliver(const v1::Publication& publication) {
    const auto inputs = inputs_.find(publication.topic());
    if (inputs == inputs_.end() || publication.start_id() == own_) return true;
    const std::string& owner = inputs->second.front()->owner();
    const auto known = known_.find(publication.start_id());
    if (!owner.empty() && known != known_.end() && known->second.name != owner) return true;
    const auto it = kept_.find({publication.start_id(), publication.topic()});
    if (it == kept_.end()) return false;
    std::deque<Received>& kept = it->second;
    while (!kept.empty() && kept.front().seq < publication.seq()) kept.pop_front();
    if (kept.empty()) return false;
    if (kept.front().seq > publication.seq()) {  // published before this node connected
      give_up(publication);
      return true;
    }
    Received message = std::move(kept.front());
    kept.pop_front();
    for (std::size_t i = 0; i + 1 < inputs->second.size(); ++i) inputs->second[i]->push(message);
    inputs->second.back()->push(std::move(message));
    return true;
  }
  /// Lock-step: counts a message that will never come.
  void give_up(const v1::Publication& publication) {
    const auto inputs = inputs_.find(publication.topic());
    if (inputs == inputs_.end()) return;
    for (const auto& input : inputs->second) ++input->counters.lost;
  }

  void* data_handle() const { return data_.handle(); }
  void* reliable_handle() const { return reliable_.handle(); }
  std::uint64_t malformed() const { return data_.malformed() + reliable_.malformed() + strangers_; }
  /// False once a publisher's memory could not be mapped: it shall send copies.
  bool maps() const { return maps_; }

 private:
  static constexpr int kDataHighWater = 32;
  static constexpr int kReliableHighWater = 64;
  static constexpr std::size_t kMostSaid = 100;
  static constexpr int kDrainMessages = 20'000;  // at most, so that a flood cannot stop the node

  struct Known {
    std::string name;
    bool member = false;  ///< member of the lock-step
    int pid = 0;          ///< 0: on another host
  };
  bool drain(SubSocket& socket, bool reliable) {
    Incoming incoming;
    int n = 0;
    for (; n < kDrainMessages && socket.receive(incoming); ++n) {
      dispatch(incoming, reliable);
    }
    return n > 0;
  }
  /// True unless `input` obeys one node alone and the message is not from its present process (by
  /// tcp, if that is on another host), whatever start its header names.
  bool obeyed(Input& input, const WireHeader& header, const Known& known, const Frame& frame) {
    if (input.owner().empty()) return true;
    const int pid = frame.peer_pid();
    const auto current = current_.find(input.owner());
    if (known.name == input.owner() && pid == known.pid && current->second == header.start_id)
      return true;
    ++input.counters.rejected;
    if (said_.size() < kMostSaid && said_.emplace(header.start_id, pid).second) {
      const bool far = current != current_.end() && known_[current->second].pid == 0;
      warn("topic {}: messages of node {}, {}, are refused: only node {} on {} host is obeyed",
           input.topic(), known.name, pid == 0 ? "by tcp" : fmt::format("process {}", pid),
           input.owner(), far ? "another" : "this");
    }
    return false;
  }
  /// The publisher's memory that holds the payload; null: it has ended, or cannot be mapped.
  std::shared_ptr<MappedPayloads> memory(const Incoming& incoming) {
    const int pid = incoming.header.peer_pid();
    auto& mapped = mapped_[{pid, incoming.place->fd}];
    if (mapped == nullptr) mapped = MappedPayloads::open(pid, incoming.place->fd);
    if (mapped == nullptr && errno != ENOENT) maps_ = false;
    return mapped;
  }
  void dispatch(Incoming& incoming, bool reliable) {
    const WireHeader& header = incoming.message.header;
    const auto it = inputs_.find(incoming.message.topic);
    if (it == inputs_.end()) return;
    const auto known = known_.find(header.start_id);
    if (known == known_.end()) {  // no socket of ours is connected to it
      ++strangers_;
      return;
    }
    Received message{.payload = {},
                     .stamp = header.stamp,
                     .seq = header.seq,
                     .source = known->second.name,
                     .start_id = header.start_id};
    bool told = false;
    const auto usable = [&](Input& input) {
      const std::uint64_t lost = input.counters.lost;
      if (uses_reliable_socket(input) != reliable ||
          !obeyed(input, header, known->second, incoming.header) ||
          !input.fresh(header.start_id, header.seq))
        return false;
      if (reliable && input.counters.lost > lost && !std::exchange(told, true)) {
        reliable_.tell_missed(header.start_id, input.counters.lost - lost);
      }
      if (header.type_hash == input.type_hash()) return true;
      ++input.counters.rejected;  // why was said when the nodes met
      return false;
    };
    if (lockstep_ && known->second.member) {
      if (!usable(*it->second.front())) return;
      message.payload = incoming.payload.view();
      kept_[{header.start_id, it->first}].push_back(std::move(message));
      return;  // deliver() hands it to all inputs of the topic
    }
    if (incoming.place) {
      for (const auto& input : it->second) {
        if (input->policy() != Policy::latest || !usable(*input)) continue;
        if (auto mapped = memory(incoming)) {
          input->push(message, std::move(mapped), *incoming.place);
        } else {
          ++input->counters.lost;
        }
      }
      return;
    }
    const std::string_view payload = incoming.payload.view();
    Input* last = nullptr;  // it takes what the others copy
    for (const auto& input : it->second) {
      if (!usable(*input)) continue;
      if (last == nullptr) {
        message.payload = payload;
      } else {
        last->push(message);
      }
      last = input.get();
    }
    if (last != nullptr) last->push(std::move(message));
  }
  bool uses_reliable_socket(const Input& input) const {
    return lockstep_ || input.policy() == Policy::reliable;
  }

  std::uint64_t own_;  // start_id of this node, whose own messages are ignored
  SubSocket data_, reliable_;
  bool lockstep_;
  std::map<std::string, std::vector<std::shared_ptr<Input>>, std::less<>> inputs_;
  std::map<std::uint64_t, Known> known_;                       ///< by start_id
  std::map<std::string, std::uint64_t, std::less<>> current_;  ///< start_id last met, by name
  std::set<std::pair<std::uint64_t, int>> said_;  ///< starts and processes that were refused
  std::uint64_t strangers_ = 0;                   ///< messages of starts that were never met
  std::map<std::pair<int, std::uint64_t>, std::shared_ptr<MappedPayloads>> mapped_;  ///< by pid, fd
  bool maps_ = true;
  std::map<std::pair<std::uint64_t, std::string>, std::deque<Received>> kept_;
};

}  // namespace mimesis::runtime
