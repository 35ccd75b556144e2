#include "common/runtime/sub_socket.h"

namespace mimesis::runtime {
namespace {
constexpr std::chrono::milliseconds kLastWords(200);
}

SubSocket::SubSocket(ZmqContext& context, int high_water_messages, std::uint64_t start_id)
    : socket_(context, ZMQ_SUB) {
  socket_.set(ZMQ_RCVHWM, high_water_messages);
  socket_.set(ZMQ_SUBSCRIBE, hello(start_id));
}

void SubSocket::subscribe(const std::string& topic) {
  if (topics_.insert(topic).second) socket_.set(ZMQ_SUBSCRIBE, subscription(topic));
}

void SubSocket::connect(std::uint64_t publisher, const std::string& endpoint) {
  if (endpoints_.emplace(publisher, endpoint).second) socket_.connect(endpoint);
}

void SubSocket::retire(std::uint64_t publisher) {
  if (endpoints_.contains(publisher)) retired_.emplace(publisher, Clock::now() + kLastWords);
}

void SubSocket::disconnect_retired() {
  const auto now = Clock::now();
  std::erase_if(retired_, [&](const auto& entry) {
    if (now < entry.second) return false;
    const auto it = endpoints_.find(entry.first);
    socket_.disconnect(it->second);
    endpoints_.erase(it);
    return true;
  });
}

bool SubSocket::receive(Incoming& incoming) {
  while (socket_.receive(incoming.header)) {
    const auto message = decode_frame(incoming.header.view());
    if (!message || !incoming.header.more() || !socket_.receive(incoming.payload) ||
        incoming.payload.more()) {
      ++malformed_;
      socket_.skip_rest(incoming.payload.more() ? incoming.payload : incoming.header);
      continue;
    }
    incoming.message = *message;
    return true;
  }
  if (!retired_.empty()) disconnect_retired();  // only now: what had arrived of them is read
  return false;
}

}  // namespace mimesis::runtime
