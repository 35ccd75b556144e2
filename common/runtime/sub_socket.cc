#include "common/runtime/sub_socket.h"

namespace mimesis::runtime {

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

void SubSocket::disconnect(std::uint64_t publisher) {
  const auto it = endpoints_.find(publisher);
  if (it == endpoints_.end()) return;
  socket_.disconnect(it->second);
  endpoints_.erase(it);
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
  return false;
}

}  // namespace mimesis::runtime
