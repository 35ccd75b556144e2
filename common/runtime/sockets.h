#pragma once
#include <zmq.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "common/runtime/wire.h"

namespace mimesis::runtime {

/// A Unix socket that keeps packets whole and reports at once when the other process dies:
/// lock-step's path, four times faster than ZeroMQ's (reference/transport.md).
class PacketSocket {
 public:
  PacketSocket() = default;
  explicit PacketSocket(int fd) : fd_(fd) {}
  ~PacketSocket();
  PacketSocket(PacketSocket&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  PacketSocket& operator=(PacketSocket&& other) noexcept;

  /// Replaces a file at `path`. @throws ConfigError naming the path.
  static PacketSocket listen(const std::string& path);
  /// Not valid() if no process listens there.
  static PacketSocket connect(const std::string& path);
  /// Next connection of a listener; not valid() if there is none.
  PacketSocket accept() const;

  /// Waits while the receiver's buffer is full. False if the other end is gone.
  bool send(std::string_view packet) const;
  enum class Result { packet, nothing, closed };
  /// Does not wait.
  Result receive(std::string& packet) const;

  bool valid() const { return fd_ >= 0; }
  int fd() const { return fd_; }

 private:
  int fd_ = -1;
};

/// ZeroMQ context with one I/O thread (a second one gains nothing, reference/transport.md).
class ZmqContext {
 public:
  ZmqContext();
  ~ZmqContext();
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
  explicit Frame(std::size_t size);
  explicit Frame(std::string_view bytes);
  ~Frame() { zmq_msg_close(&msg_); }
  Frame(Frame&& other) noexcept : Frame() { zmq_msg_move(&msg_, &other.msg_); }
  Frame& operator=(Frame&& other) noexcept {
    zmq_msg_move(&msg_, &other.msg_);
    return *this;
  }
  Frame share() const;
  char* data() { return static_cast<char*>(zmq_msg_data(&msg_)); }
  std::size_t size() const { return zmq_msg_size(&msg_); }
  std::string_view view() { return {data(), size()}; }
  bool more() const { return zmq_msg_more(&msg_) != 0; }
  zmq_msg_t* msg() { return &msg_; }

 private:
  mutable zmq_msg_t msg_;  // zmq_msg_copy takes its source by non-const pointer
};

/// A socket that never blocks.
class ZmqSocket {
 public:
  ZmqSocket(ZmqContext& context, int type);
  ~ZmqSocket();
  ZmqSocket(const ZmqSocket&) = delete;
  ZmqSocket& operator=(const ZmqSocket&) = delete;

  void set(int option, int value);
  void set(int option, std::string_view value);
  /// @throws ConfigError naming the endpoint and the reason.
  void bind(const std::string& endpoint);
  /// Endpoint of the last bind, with the port chosen if it was a wildcard.
  std::string bound_endpoint() const;
  void connect(const std::string& endpoint);
  void disconnect(const std::string& endpoint);

  /// False if it would block (or there is no receiver).
  bool send(Frame& frame, bool more);
  bool receive(Frame& frame);
  /// Discards the remaining frames of a message whose `frame` was read.
  void skip_rest(const Frame& frame);
  void* handle() const { return handle_; }

 private:
  void* handle_;
};

struct Incoming {
  WireMessage message;  ///< points into `header`
  Frame header, payload;
};

/// Receiving socket: subscriptions, and connections by the publisher's start_id.
class SubSocket {
 public:
  /// `start_id`: own, for the greeting.
  SubSocket(ZmqContext& context, int high_water_messages, std::uint64_t start_id);

  void subscribe(const std::string& topic);  ///< idempotent
  void connect(std::uint64_t publisher, const std::string& endpoint);
  /// The publisher has ended. The connection is closed a little later, because its last messages
  /// may be in transit.
  void retire(std::uint64_t publisher);
  bool connected(std::uint64_t publisher) const { return endpoints_.contains(publisher); }

  /// Next well-formed message; false if there is none now.
  bool receive(Incoming& incoming);
  std::uint64_t malformed() const { return malformed_; }
  void* handle() const { return socket_.handle(); }

 private:
  using Clock = std::chrono::steady_clock;
  void disconnect_retired();

  ZmqSocket socket_;
  std::set<std::string> topics_;
  std::map<std::uint64_t, std::string> endpoints_;      ///< by start_id
  std::map<std::uint64_t, Clock::time_point> retired_;  ///< start_id -> when to disconnect
  std::uint64_t malformed_ = 0;
};

}  // namespace mimesis::runtime
