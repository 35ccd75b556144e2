#pragma once
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <memory>
#include <string>
#include <utility>

namespace mimesis::view {

/// A TCP stream under a WebSocket that gathers small messages, so that they share a system call: a
/// write completes when its bytes are taken over. Of one thread.
class GatheredStream {
 public:
  using next_layer_type = boost::beast::tcp_stream;
  using executor_type = next_layer_type::executor_type;

  explicit GatheredStream(next_layer_type stream)
      : state_(std::make_shared<State>(std::move(stream))) {}
  GatheredStream(GatheredStream&&) = default;
  ~GatheredStream() {
    boost::beast::error_code ignored;  // what is under way ends with the socket
    if (state_) state_->stream.socket().close(ignored);
  }

  next_layer_type& next_layer() { return state_->stream; }
  const next_layer_type& next_layer() const { return state_->stream; }
  executor_type get_executor() noexcept { return state_->stream.get_executor(); }

  /// Another write will follow the next one at once: a few bytes may wait for it.
  void expect_more(bool more) { state_->more = more; }

  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    state_->stream.async_read_some(buffers, std::forward<Handler>(handler));
  }
  template <class Buffers, class Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    State::write(state_, buffers, std::forward<Handler>(handler));
  }

 private:
  /// More than kEnough_bytes are not gathered but sent from where they are.
  static constexpr std::size_t kMost_bytes = 1 << 18, kEnough_bytes = 1 << 15;

  struct State : std::enable_shared_from_this<State> {
    explicit State(next_layer_type s) : stream(std::move(s)), room(stream.get_executor()) {
      room.expires_at(std::chrono::steady_clock::time_point::max());
    }

    template <class Buffers, class Handler>
    static void write(std::shared_ptr<State> s, const Buffers& buffers, Handler&& handler) {
      namespace beast = boost::beast;
      const bool large = beast::buffer_bytes(buffers) > kEnough_bytes;
      if (s->error || (!large && s->filled.size() < kMost_bytes)) {
        const std::size_t size = s->error ? 0 : s->take(buffers);
        boost::asio::post(
            s->stream.get_executor(),
            beast::bind_front_handler(std::forward<Handler>(handler), s->error, size));
      } else if (large && !s->sending && s->filled.empty()) {
        s->sending = true;
        boost::asio::async_write(s->stream, buffers,
                                 [s, handler = std::forward<Handler>(handler)](
                                     beast::error_code now, std::size_t size) mutable {
                                   s->sent_until(now);
                                   std::move(handler)(now, size);
                                 });
      } else {
        s->more = false;
        s->flush();
        s->room.async_wait(
            [s, buffers, handler = std::forward<Handler>(handler)](beast::error_code) mutable {
              write(s, buffers, std::move(handler));
            });
      }
    }

    template <class Buffers>
    std::size_t take(const Buffers& buffers) {
      const std::size_t before = filled.size();
      for (const boost::asio::const_buffer part : boost::beast::buffers_range_ref(buffers))
        filled.append(static_cast<const char*>(part.data()), part.size());
      const std::size_t size = filled.size() - before;
      flush();
      return size;
    }
    void flush() {
      if (sending || filled.empty() || error || (more && filled.size() < kEnough_bytes)) return;
      sending = true;
      std::swap(filled, sent);
      filled.clear();
      boost::asio::async_write(stream, boost::asio::buffer(sent),
                               [self = shared_from_this()](boost::beast::error_code now,
                                                           std::size_t) { self->sent_until(now); });
    }
    void sent_until(boost::beast::error_code now) {
      sending = false;
      error = now;
      room.cancel();
      flush();
    }

    next_layer_type stream;
    boost::asio::steady_timer room;  ///< cancelled when there is some
    std::string filled, sent;        ///< the second is under way
    bool sending = false, more = false;
    boost::beast::error_code error;
  };

  std::shared_ptr<State> state_;
};

// Beast asks for these, to end a WebSocket.
inline void teardown(boost::beast::role_type role, GatheredStream& stream,
                     boost::beast::error_code& error) {
  using boost::beast::websocket::teardown;
  teardown(role, stream.next_layer(), error);
}
template <class Handler>
void async_teardown(boost::beast::role_type role, GatheredStream& stream, Handler&& handler) {
  using boost::beast::websocket::async_teardown;
  async_teardown(role, stream.next_layer(), std::forward<Handler>(handler));
}

}  // namespace mimesis::view
