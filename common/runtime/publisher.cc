#include "common/runtime/publisher.h"

#include <algorithm>

#include "common/error.h"

namespace mimesis::runtime {
namespace {
// Messages per subscriber and side. Small: with 64 KiB messages a slow subscriber costs 4 MB, not
// 130.
constexpr int kDataHighWater = 32;
constexpr int kReliableHighWater = 64;
// Per topic; whichever is reached first.
constexpr std::size_t kBacklogMessages = 100'000;
constexpr std::size_t kBacklogBytes = std::size_t{128} << 20U;
// A subscriber that takes nothing for this long, once the bound was reached, is stuck.
constexpr std::chrono::milliseconds kStuck(500);
// Long enough for the last words of a node that stops, short enough for one whose peer is stuck.
constexpr int kLinger_ms = 1000;
}  // namespace

Publisher::Publisher(ZmqContext& context, std::uint64_t start_id)
    : start_id_(start_id), data_(context, ZMQ_XPUB), reliable_(context, ZMQ_XPUB) {
  for (ZmqSocket* socket : {&data_, &reliable_}) {
    socket->set(ZMQ_XPUB_VERBOSER, 1);
    socket->set(ZMQ_LINGER, kLinger_ms);
  }
  data_.set(ZMQ_SNDHWM, kDataHighWater);
  reliable_.set(ZMQ_SNDHWM, kReliableHighWater);
  reliable_.set(ZMQ_XPUB_NODROP, 1);
}

Publisher::Topic& Publisher::add(const std::string& topic, std::uint64_t type_hash, bool latched) {
  auto [it, fresh] = topics_.emplace(topic, std::make_unique<Topic>());
  MIMESIS_ASSERT(fresh);
  it->second->frame = encode_frame(topic, {});
  it->second->hash = type_hash;
  it->second->latched = latched;
  return *it->second;
}

std::uint64_t Publisher::next_seq(const Topic& topic) { return topic.seq + 1; }
std::size_t Publisher::subscribers(const Topic& topic) {
  return topic.data_subscribers + topic.reliable_subscribers;
}

bool Publisher::send_frames(ZmqSocket& socket, Frame& header, Frame& payload) {
  // XPUB decides on the first frame for the whole message.
  return socket.send(header, true) && socket.send(payload, false);
}

std::uint64_t Publisher::send(Topic& topic, Frame payload, Time stamp, std::uint64_t tick) {
  ++topic.seq;
  ++sent_;
  rewrite_header(topic.frame, {.seq = topic.seq,
                               .stamp = stamp,
                               .type_hash = topic.hash,
                               .start_id = start_id_,
                               .tick = tick});
  Frame header{std::string_view(topic.frame)};
  if (topic.latched) topic.last = {header.share(), payload.share(), payload.size()};
  Frame data_header = header.share();
  Frame data_payload = payload.share();
  send_frames(data_, data_header, data_payload);
  enqueue(topic, std::move(header), std::move(payload));
  return topic.seq;
}

void Publisher::enqueue(Topic& topic, Frame header, Frame payload) {
  if (!held_ && topic.waiting.empty() && send_frames(reliable_, header, payload)) {
    topic.overflowing = false;
    return;
  }
  topic.waiting_bytes += payload.size();
  const std::size_t size = payload.size();
  topic.waiting.push_back({std::move(header), std::move(payload), size});
  flush(topic);
}

void Publisher::Topic::pop() {
  waiting_bytes -= waiting.front().size;
  waiting.pop_front();
}

void Publisher::flush(Topic& topic) {
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

void Publisher::force(Topic& topic) {
  // Without NODROP the socket delivers to all that have room, and from then on does not ask those
  // that had none until they have read something: one message frees the way for the others.
  ++overflow_;
  if (!held_) {
    reliable_.set(ZMQ_XPUB_NODROP, 0);
    send_frames(reliable_, topic.waiting.front().header, topic.waiting.front().payload);
    reliable_.set(ZMQ_XPUB_NODROP, 1);
  }
  topic.pop();
}

void Publisher::serve() {
  for (ZmqSocket* socket : {&data_, &reliable_}) {
    for (Frame message; socket->receive(message);) {
      on_subscription(message.view(), socket == &reliable_);
      socket->skip_rest(message);
    }
  }
  for (auto& [name, topic] : topics_) {
    if (!topic->waiting.empty()) flush(*topic);
  }
}

void Publisher::on_subscription(std::string_view message, bool reliable) {
  if (message.size() < 2) return;
  const bool joined = message.front() == 1;
  message.remove_prefix(1);
  if (const auto start_id = decode_hello(message)) {
    if (reliable && (greetings_[*start_id] += joined ? 1 : -1) <= 0) greetings_.erase(*start_id);
    return;
  }
  message.remove_suffix(1);  // the NUL
  const auto it = topics_.find(message);
  if (it == topics_.end()) return;
  Topic& topic = *it->second;
  std::size_t& count = reliable ? topic.reliable_subscribers : topic.data_subscribers;
  if (!joined) {
    count -= std::min<std::size_t>(count, 1);
    return;
  }
  ++count;
  if (!topic.latched || topic.seq == 0) return;
  // To all subscribers; those that have it already recognise its seq.
  Frame header = topic.last.header.share();
  Frame payload = topic.last.payload.share();
  if (!reliable) {
    send_frames(data_, header, payload);
  } else if (topic.waiting.empty()) {  // otherwise it is sent later
    enqueue(topic, std::move(header), std::move(payload));
  }
}

void Publisher::release() {
  held_ = false;
  serve();
}

std::uint64_t Publisher::backlog() const {
  std::uint64_t n = 0;
  for (const auto& [name, topic] : topics_) n += topic->waiting.size();
  return n;
}

std::uint64_t Publisher::backlog_bytes() const {
  std::uint64_t n = 0;
  for (const auto& [name, topic] : topics_) n += topic->waiting_bytes;
  return n;
}

}  // namespace mimesis::runtime
