#pragma once
#include <zmq.h>

#include <memory>
#include <string>
#include <string_view>

namespace mimesis::runtime {

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

  /// False if it would block (or nobody is there to take it).
  bool send(Frame& frame, bool more);
  bool receive(Frame& frame);
  /// Discards the remaining frames of a message of which `frame` was read.
  void skip_rest(const Frame& frame);
  void* handle() const { return handle_; }

 private:
  void* handle_;
};

}  // namespace mimesis::runtime
