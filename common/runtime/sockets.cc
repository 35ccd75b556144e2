#include "common/runtime/sockets.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "common/error.h"

namespace mimesis::runtime {
namespace {

constexpr int kBacklog = 64;

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    throw ConfigError("socket path " + path +
                      " is longer than the 107 bytes that a Unix socket allows");
  }
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

}  // namespace

PacketSocket::~PacketSocket() {
  if (fd_ >= 0) close(fd_);
}
PacketSocket& PacketSocket::operator=(PacketSocket&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

PacketSocket PacketSocket::listen(const std::string& path) {
  const sockaddr_un address = address_of(path);
  PacketSocket s(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  unlink(path.c_str());
  if (!s.valid() || bind(s.fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(s.fd_, kBacklog) != 0) {
    throw ConfigError("cannot listen on " + path + ": " + std::strerror(errno));
  }
  return s;
}

PacketSocket PacketSocket::connect(const std::string& path) {
  const sockaddr_un address = address_of(path);
  PacketSocket s(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  if (!s.valid() ||
      ::connect(s.fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    return {};
  return s;
}

PacketSocket PacketSocket::accept() const {
  return PacketSocket(accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC));
}

bool PacketSocket::send(std::string_view packet) const {
  ssize_t sent = 0;
  do {
    sent = ::send(fd_, packet.data(), packet.size(), MSG_NOSIGNAL);
  } while (sent < 0 && errno == EINTR);
  return sent == static_cast<ssize_t>(packet.size());
}

PacketSocket::Result PacketSocket::receive(std::string& packet) const {
  // The length first: packets are not limited by a buffer of this process.
  ssize_t size = 0;
  do {
    size = recv(fd_, nullptr, 0, MSG_PEEK | MSG_TRUNC | MSG_DONTWAIT);
  } while (size < 0 && errno == EINTR);
  if (size < 0) {
    return errno == EAGAIN || errno == EWOULDBLOCK ? Result::nothing : Result::closed;
  }
  if (size == 0) return Result::closed;  // packets of Mimesis are never empty
  packet.resize(static_cast<std::size_t>(size));
  return recv(fd_, packet.data(), packet.size(), MSG_DONTWAIT) == size ? Result::packet
                                                                       : Result::closed;
}

namespace {
// The default of 100 ms makes connect-before-bind cost 187 ms; 1 ms: 3-9 ms.
constexpr int kReconnect_ms = 1;
constexpr int kReconnectMax_ms = 200;
constexpr std::size_t kMaxIpcPath = 107;  // sizeof sockaddr_un::sun_path - 1
}  // namespace

ZmqContext::ZmqContext() : handle_(zmq_ctx_new()) {
  MIMESIS_ASSERT(handle_ != nullptr);
  zmq_ctx_set(handle_, ZMQ_IO_THREADS, 1);
}
ZmqContext::~ZmqContext() {
  while (zmq_ctx_term(handle_) != 0 && errno == EINTR) {
  }
}

Frame::Frame(std::size_t size) { MIMESIS_ASSERT(zmq_msg_init_size(&msg_, size) == 0); }
Frame::Frame(std::string_view bytes) : Frame(bytes.size()) {
  if (!bytes.empty()) std::memcpy(data(), bytes.data(), bytes.size());
}
Frame Frame::share() const {
  Frame copy;
  zmq_msg_copy(&copy.msg_, &msg_);
  return copy;
}

ZmqSocket::ZmqSocket(ZmqContext& context, int type) : handle_(zmq_socket(context.handle(), type)) {
  if (handle_ == nullptr) throw ConfigError(std::string("zmq_socket: ") + zmq_strerror(errno));
  set(ZMQ_LINGER, 0);
  set(ZMQ_RECONNECT_IVL, kReconnect_ms);
  set(ZMQ_RECONNECT_IVL_MAX, kReconnectMax_ms);
}
ZmqSocket::~ZmqSocket() { zmq_close(handle_); }

void ZmqSocket::set(int option, int value) {
  MIMESIS_ASSERT(zmq_setsockopt(handle_, option, &value, sizeof value) == 0);
}
void ZmqSocket::set(int option, std::string_view value) {
  MIMESIS_ASSERT(zmq_setsockopt(handle_, option, value.data(), value.size()) == 0);
}

void ZmqSocket::bind(const std::string& endpoint) {
  constexpr std::string_view kIpc = "ipc://";
  if (endpoint.starts_with(kIpc) && endpoint.size() - kIpc.size() > kMaxIpcPath) {
    throw ConfigError(
        "socket path " + endpoint.substr(kIpc.size()) + " has " +
        std::to_string(endpoint.size() - kIpc.size()) +
        " bytes, a Unix socket allows 107: use a shorter XDG_RUNTIME_DIR, graph or node name");
  }
  if (zmq_bind(handle_, endpoint.c_str()) != 0) {
    throw ConfigError("cannot bind " + endpoint + ": " + zmq_strerror(errno));
  }
}

std::string ZmqSocket::bound_endpoint() const {
  std::array<char, 256> text{};
  std::size_t size = text.size();
  zmq_getsockopt(handle_, ZMQ_LAST_ENDPOINT, text.data(), &size);
  return text.data();
}

void ZmqSocket::connect(const std::string& endpoint) {
  if (zmq_connect(handle_, endpoint.c_str()) != 0) {
    throw ConfigError("cannot connect to " + endpoint + ": " + zmq_strerror(errno));
  }
}
void ZmqSocket::disconnect(const std::string& endpoint) {
  zmq_disconnect(handle_, endpoint.c_str());
}

bool ZmqSocket::send(Frame& frame, bool more) {
  int rc = 0;
  do {
    rc = zmq_msg_send(frame.msg(), handle_, ZMQ_DONTWAIT | (more ? ZMQ_SNDMORE : 0));
  } while (rc < 0 && errno == EINTR);
  return rc >= 0;
}

bool ZmqSocket::receive(Frame& frame) {
  int rc = 0;
  do {
    rc = zmq_msg_recv(frame.msg(), handle_, ZMQ_DONTWAIT);
  } while (rc < 0 && errno == EINTR);
  return rc >= 0;
}

void ZmqSocket::skip_rest(const Frame& frame) {
  bool more = frame.more();
  while (more) {
    Frame rest;
    if (!receive(rest)) return;
    more = rest.more();
  }
}

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
