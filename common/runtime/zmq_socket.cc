#include "common/runtime/zmq_socket.h"

#include <array>
#include <cerrno>
#include <cstring>

#include "common/error.h"

namespace mimesis::runtime {
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

}  // namespace mimesis::runtime
