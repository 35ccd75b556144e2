#pragma once
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <zmq.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

#include "common/error.h"
#include "common/runtime/wire.h"

namespace mimesis::runtime {

/// A Unix socket that keeps packets whole and reports at once when the other process dies:
/// lock-step's path, four times faster than ZeroMQ's (reference/transport.md).
class PacketSocket {
 public:
  PacketSocket() = default;
  explicit PacketSocket(int fd) : fd_(fd) {}
  ~PacketSocket() {
    if (fd_ >= 0) close(fd_);
  }
  PacketSocket(PacketSocket&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  PacketSocket& operator=(PacketSocket&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }

  /// Replaces a file at `path`. @throws ConfigError naming the path.
  static PacketSocket listen(const std::string& path) {
    const sockaddr_un address = address_of(path);
    PacketSocket s(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    unlink(path.c_str());
    if (!s.valid() ||
        bind(s.fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
        ::listen(s.fd_, kBacklog) != 0) {
      throw ConfigError("cannot listen on " + path + ": " + std::strerror(errno));
    }
    return s;
  }
  /// Not valid() if no process listens there.
  static PacketSocket connect(const std::string& path) {
    const sockaddr_un address = address_of(path);
    PacketSocket s(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
    if (!s.valid() ||
        ::connect(s.fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      return {};
    return s;
  }
  /// Next connection of a listener; not valid() if there is none.
  PacketSocket accept() const {
    return PacketSocket(accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  }

  /// Waits while the receiver's buffer is full, if this end has connected. False if the other end
  /// is gone, or the packet cannot be sent.
  bool send(std::string_view packet) const {
    ssize_t sent = 0;
    do {
      sent = ::send(fd_, packet.data(), packet.size(), MSG_NOSIGNAL);
    } while (sent < 0 && errno == EINTR);
    return sent == static_cast<ssize_t>(packet.size());
  }
  enum class Result { packet, nothing, closed };
  /// Does not wait.
  Result receive(std::string& packet) const {
    // The length first: packets are not limited by a buffer of this process.
    ssize_t size = 0;
    do {
      size = recv(fd_, nullptr, 0, MSG_PEEK | MSG_TRUNC | MSG_DONTWAIT);
    } while (size < 0 && errno == EINTR);
    if (size < 0) {
      return errno == EAGAIN || errno == EWOULDBLOCK ? Result::nothing : Result::closed;
    }
    if (size == 0) return Result::closed;  // packets of ours are never empty
    packet.resize(static_cast<std::size_t>(size));
    return recv(fd_, packet.data(), packet.size(), MSG_DONTWAIT) == size ? Result::packet
                                                                         : Result::closed;
  }

  bool valid() const { return fd_ >= 0; }
  int fd() const { return fd_; }

 private:
  static constexpr int kBacklog = 64;

  static sockaddr_un address_of(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.size() >= sizeof address.sun_path) {
      throw ConfigError("socket path " + path +
                        " is longer than the 107 bytes that a Unix socket allows");
    }
    std::memcpy(address.sun_path, path.data(), path.size());
    return address;
  }

  int fd_ = -1;
};

/// ZeroMQ context with one I/O thread (a second one gains nothing, reference/transport.md).
class ZmqContext {
 public:
  ZmqContext() : handle_(zmq_ctx_new()) {
    MIMESIS_ASSERT(handle_ != nullptr);
    zmq_ctx_set(handle_, ZMQ_IO_THREADS, 1);
  }
  ~ZmqContext() {
    while (zmq_ctx_term(handle_) != 0 && errno == EINTR) {
    }
  }
  ZmqContext(const ZmqContext&) = delete;
  ZmqContext& operator=(const ZmqContext&) = delete;
  void* handle() const { return handle_; }

 private:
  void* handle_;
};

/// One frame. Copies share the bytes.
class Frame {
 public:
  Frame() { zmq_msg_init(&msg_); }
  explicit Frame(std::size_t size) { MIMESIS_ASSERT(zmq_msg_init_size(&msg_, size) == 0); }
  explicit Frame(std::string_view bytes) : Frame(bytes.size()) {
    if (!bytes.empty()) std::memcpy(data(), bytes.data(), bytes.size());
  }
  ~Frame() { zmq_msg_close(&msg_); }
  Frame(Frame&& other) noexcept : Frame() { zmq_msg_move(&msg_, &other.msg_); }
  Frame& operator=(Frame&& other) noexcept {
    zmq_msg_move(&msg_, &other.msg_);
    return *this;
  }
  Frame share() const {
    Frame copy;
    zmq_msg_copy(&copy.msg_, &msg_);
    return copy;
  }
  char* data() { return static_cast<char*>(zmq_msg_data(&msg_)); }
  std::size_t size() const { return zmq_msg_size(&msg_); }
  std::string_view view() { return {data(), size()}; }
  /// Process that sent a frame over a Unix socket, attested by the kernel; 0 if it came by tcp.
  int peer_pid() const {
    const char* address = zmq_msg_gets(&msg_, "Peer-Address");  // localhost:UID:GID:PID
    if (address == nullptr || !std::string_view(address).starts_with("localhost:")) return 0;
    return std::atoi(std::strrchr(address, ':') + 1);
  }
  /// Key of the host that it came from, which TcpGate admitted; empty: it came from this host.
  std::string peer_key() const {
    const char* key = zmq_msg_gets(&msg_, "User-Id");
    return key != nullptr ? key : "";
  }
  /// File descriptor of the connection that it came by; -1: of none that lives.
  int connection() const { return zmq_msg_get(&msg_, ZMQ_SRCFD); }
  /// Ends the connection that the frame came by, if it still exists.
  void end_connection() const {
    const int fd = connection();
    ucred peer{};
    socklen_t size = sizeof peer;
    if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 && peer.pid == peer_pid())
      shutdown(fd, SHUT_RDWR);
  }
  bool more() const { return zmq_msg_more(&msg_) != 0; }
  zmq_msg_t* msg() { return &msg_; }

 private:
  mutable zmq_msg_t msg_;  // zmq_msg_copy takes its source by non-const pointer
};

/// A socket that never blocks.
class ZmqSocket {
 public:
  ZmqSocket(ZmqContext& context, int type) : handle_(zmq_socket(context.handle(), type)) {
    if (handle_ == nullptr) throw ConfigError(std::string("zmq_socket: ") + zmq_strerror(errno));
    set(ZMQ_LINGER, 0);
    set(ZMQ_RECONNECT_IVL, kReconnect_ms);
    set(ZMQ_RECONNECT_IVL_MAX, kReconnectMax_ms);
    limit_frames(kLargestMessage);
  }
  ~ZmqSocket() { zmq_close(handle_); }
  ZmqSocket(const ZmqSocket&) = delete;
  ZmqSocket& operator=(const ZmqSocket&) = delete;

  void set(int option, int value) {
    MIMESIS_ASSERT(zmq_setsockopt(handle_, option, &value, sizeof value) == 0);
  }
  /// A connection that sends a larger frame is closed for good.
  void limit_frames(std::size_t bytes) {
    const auto value = static_cast<std::int64_t>(bytes);
    MIMESIS_ASSERT(zmq_setsockopt(handle_, ZMQ_MAXMSGSIZE, &value, sizeof value) == 0);
  }
  void set(int option, std::string_view value) {
    MIMESIS_ASSERT(zmq_setsockopt(handle_, option, value.data(), value.size()) == 0);
  }
  /// @throws ConfigError naming the endpoint and the reason.
  void bind(const std::string& endpoint) {
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
  /// Endpoint of the last bind, with the port chosen if it was a wildcard.
  std::string bound_endpoint() const {
    std::array<char, 256> text{};
    std::size_t size = text.size();
    zmq_getsockopt(handle_, ZMQ_LAST_ENDPOINT, text.data(), &size);
    return text.data();
  }
  void connect(const std::string& endpoint) {
    if (zmq_connect(handle_, endpoint.c_str()) != 0) {
      throw ConfigError("cannot connect to " + endpoint + ": " + zmq_strerror(errno));
    }
  }
  void disconnect(const std::string& endpoint) { zmq_disconnect(handle_, endpoint.c_str()); }

  /// False if it would block (or there is no receiver).
  bool send(Frame& frame, bool more) {
    int rc = 0;
    do {
      rc = zmq_msg_send(frame.msg(), handle_, ZMQ_DONTWAIT | (more ? ZMQ_SNDMORE : 0));
    } while (rc < 0 && errno == EINTR);
    return rc >= 0;
  }
  bool receive(Frame& frame) {
    int rc = 0;
    do {
      rc = zmq_msg_recv(frame.msg(), handle_, ZMQ_DONTWAIT);
    } while (rc < 0 && errno == EINTR);
    more_ = rc >= 0 && frame.more();
    return rc >= 0;
  }
  /// First frame of the next message. What nobody has read of the one before is discarded, up to a
  /// bound at a time: a message of a million frames holds nobody up, and ends its connection.
  bool receive_first(Frame& frame) {
    for (int n = 0; more_; ++n) {
      if (n == kMostFrames || !receive(frame)) return false;
      if (++skipped_ == kMostFrames) frame.end_connection();
    }
    skipped_ = 0;
    return receive(frame);
  }
  void* handle() const { return handle_; }

 private:
  // The default of 100 ms makes connect-before-bind cost 187 ms; 1 ms: 3-9 ms.
  static constexpr int kReconnect_ms = 1, kReconnectMax_ms = 200;
  static constexpr std::size_t kMaxIpcPath = 107;  // sizeof sockaddr_un::sun_path - 1
  static constexpr int kMostFrames = 10'000;       // beyond those that a message of ours has

  void* handle_;
  bool more_ = false;  ///< frames of the last message are left
  int skipped_ = 0;    ///< of that message
};

}  // namespace mimesis::runtime
