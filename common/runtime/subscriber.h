#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/runtime/bus.h"
#include "common/runtime/sockets.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {

/// One input port: applies the policy, counts lost and dropped messages.
class Input {
 public:
  Input(std::string topic, std::uint64_t type_hash, const InOptions& options)
      : topic_(std::move(topic)), hash_(type_hash), options_(options) {}

  const std::string& topic() const { return topic_; }
  std::uint64_t type_hash() const { return hash_; }
  Policy policy() const { return options_.policy; }

  /// False for a repetition (of a latched message), which is then ignored. Counts gaps.
  bool fresh(std::uint64_t start_id, std::uint64_t seq);
  void push(Received message);
  std::optional<Received> pop();

  InCounters counters;
  Time newest{};  ///< stamp of the newest message received

 private:
  std::string topic_;
  std::uint64_t hash_;
  InOptions options_;
  std::deque<Received> pending_;
  std::map<std::uint64_t, std::uint64_t> last_seq_;  ///< by start_id
};

/// Receiving half of a node: `latest` and `queue` inputs on a lossy socket, `reliable` ones (in
/// lock-step: all) on a second one.
class Subscriber {
 public:
  Subscriber(ZmqContext& context, std::uint64_t start_id, bool lockstep);

  std::shared_ptr<Input> add(const std::string& topic, std::uint64_t type_hash,
                             const InOptions& options);
  /// Connects to a node if one of its outputs is wired here.
  void meet(const v1::NodeInfo& node);
  void forget(const v1::NodeInfo& node);

  /// Moves what has arrived to the inputs; in lock-step only from nodes that do not take part in
  /// it, the rest is kept for `deliver`. True if anything arrived.
  bool drain();
  /// Lock-step: moves one message to its inputs; false if it has not arrived yet.
  bool deliver(const v1::Publication& publication);
  /// Lock-step: counts a message that will never come.
  void give_up(const v1::Publication& publication);

  void* data_handle() const { return data_.handle(); }
  void* reliable_handle() const { return reliable_.handle(); }
  std::uint64_t malformed() const { return data_.malformed() + reliable_.malformed(); }

 private:
  struct Known {
    std::string name;
    bool member = false;  ///< member of the lock-step
  };
  bool drain(SubSocket& socket, bool reliable);
  void dispatch(const Incoming& incoming, Frame& payload, bool reliable);
  bool uses_reliable_socket(const Input& input) const;

  std::uint64_t own_;  // start_id of this node, whose own messages are ignored
  SubSocket data_, reliable_;
  bool lockstep_;
  std::map<std::string, std::vector<std::shared_ptr<Input>>, std::less<>> inputs_;
  std::map<std::uint64_t, Known> known_;  ///< by start_id
  std::map<std::pair<std::uint64_t, std::string>, std::deque<Received>> kept_;
};

}  // namespace mimesis::runtime
