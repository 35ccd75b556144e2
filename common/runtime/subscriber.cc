#include "common/runtime/subscriber.h"

#include <algorithm>

namespace mimesis::runtime {
namespace {
constexpr int kDataHighWater = 32;
constexpr int kReliableHighWater = 64;
constexpr int kDrainMessages = 20'000;           // at most, so that a flood cannot stop the node
constexpr std::size_t kReliableDepth = 200'000;  // limit for an input that nobody reads
}  // namespace

bool Input::fresh(std::uint64_t start_id, std::uint64_t seq) {
  const auto [it, first] = last_seq_.emplace(start_id, seq);
  if (first) return true;
  if (seq <= it->second) return false;
  counters.lost += seq - it->second - 1;
  it->second = seq;
  return true;
}

void Input::push(Received message) {
  ++counters.received;
  newest = message.stamp;
  pending_.push_back(std::move(message));
  const std::size_t depth = options_.policy == Policy::latest  ? 1
                            : options_.policy == Policy::queue ? options_.depth
                                                               : kReliableDepth;
  if (pending_.size() > depth) {
    pending_.pop_front();
    ++counters.dropped;
  }
}

std::optional<Received> Input::pop() {
  if (pending_.empty()) return std::nullopt;
  Received message = std::move(pending_.front());
  pending_.pop_front();
  return message;
}

Subscriber::Subscriber(ZmqContext& context, std::uint64_t start_id, bool lockstep)
    : own_(start_id),
      data_(context, kDataHighWater, start_id),
      reliable_(context, kReliableHighWater, start_id),
      lockstep_(lockstep) {}

bool Subscriber::uses_reliable_socket(const Input& input) const {
  return lockstep_ || input.policy() == Policy::reliable;
}

std::shared_ptr<Input> Subscriber::add(const std::string& topic, std::uint64_t type_hash,
                                       const InOptions& options) {
  auto input = std::make_shared<Input>(topic, type_hash, options);
  inputs_[topic].push_back(input);
  (uses_reliable_socket(*input) ? reliable_ : data_).subscribe(topic);
  return input;
}

void Subscriber::meet(const v1::NodeInfo& node) {
  known_[node.start_id()] = {node.name(), node.clock() == "lockstep"};
  for (const v1::TopicInfo& output : node.outputs()) {
    const auto it = inputs_.find(output.topic());
    if (it == inputs_.end()) continue;
    for (const auto& input : it->second) {
      const bool reliable = uses_reliable_socket(*input);
      const auto& endpoints = reliable ? node.reliable_endpoints() : node.data_endpoints();
      if (!endpoints.empty()) (reliable ? reliable_ : data_).connect(node.start_id(), endpoints[0]);
    }
  }
}

void Subscriber::forget(const v1::NodeInfo& node) {
  data_.retire(node.start_id());
  reliable_.retire(node.start_id());
}

bool Subscriber::drain() {
  const bool data = drain(data_, false);
  return drain(reliable_, true) || data;
}

bool Subscriber::drain(SubSocket& socket, bool reliable) {
  Incoming incoming;
  int n = 0;
  for (; n < kDrainMessages && socket.receive(incoming); ++n) {
    dispatch(incoming, incoming.payload, reliable);
  }
  return n > 0;
}

void Subscriber::dispatch(const Incoming& incoming, Frame& payload, bool reliable) {
  const WireHeader& header = incoming.message.header;
  const auto it = inputs_.find(incoming.message.topic);
  if (it == inputs_.end()) return;
  const auto known = known_.find(header.start_id);
  Received message{.payload = {},
                   .stamp = header.stamp,
                   .seq = header.seq,
                   .source = known == known_.end() ? std::string() : known->second.name,
                   .start_id = header.start_id};
  const auto usable = [&](Input& input) {
    if (uses_reliable_socket(input) != reliable || !input.fresh(header.start_id, header.seq))
      return false;
    if (header.type_hash == input.type_hash()) return true;
    ++input.counters.rejected;  // why was said when the nodes met
    return false;
  };
  if (lockstep_ && (known == known_.end() || known->second.member)) {
    if (!usable(*it->second.front())) return;
    message.payload = payload.view();
    kept_[{header.start_id, it->first}].push_back(std::move(message));
    return;  // deliver() hands it to all inputs of the topic
  }
  for (const auto& input : it->second) {
    if (!usable(*input)) continue;
    message.payload = payload.view();
    input->push(message);
  }
}

bool Subscriber::deliver(const v1::Publication& publication) {
  const auto inputs = inputs_.find(publication.topic());
  if (inputs == inputs_.end() || publication.start_id() == own_) return true;
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

void Subscriber::give_up(const v1::Publication& publication) {
  const auto inputs = inputs_.find(publication.topic());
  if (inputs == inputs_.end()) return;
  for (const auto& input : inputs->second) ++input->counters.lost;
}

}  // namespace mimesis::runtime
