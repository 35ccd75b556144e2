// The server of `mimesis view` with one client on this computer: small messages, and images of
// 640 x 480 in colour. Of an iteration all messages wait at once, fewer than are left out.
#include <benchmark/benchmark.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <thread>

#include "tools/mimesis/view/server.h"

namespace mimesis::view {
namespace {

namespace beast = boost::beast;
namespace net = boost::asio;

class Client {
 public:
  explicit Client(std::uint16_t port) {
    socket_.next_layer().connect({net::ip::make_address("127.0.0.1"), port});
    socket_.set_option(beast::websocket::stream_base::decorator([](auto& request) {
      request.set(beast::http::field::sec_websocket_protocol, "foxglove.sdk.v1");
    }));
    socket_.read_message_max(0);
    socket_.handshake("127.0.0.1", "/?key=k");
    socket_.text(true);
    socket_.write(
        net::buffer(std::string(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":1}]})")));
  }
  /// Reads this many messages of the channel.
  void take(std::size_t messages) {
    while (messages > 0) {
      buffer_.consume(buffer_.size());
      socket_.read(buffer_);
      if (!socket_.got_text()) --messages;
    }
  }

 private:
  net::io_context io_;
  beast::websocket::stream<net::ip::tcp::socket> socket_{io_};
  beast::flat_buffer buffer_;
};

void stream(benchmark::State& state) {
  const auto size = static_cast<std::size_t>(state.range(0));
  const auto batch = static_cast<std::size_t>(state.range(1));
  Server server({.name = "bench", .port = 0, .key = "k", .page = "/nowhere"});
  server.announce(std::vector<Channel>{{1, "bench/out", "bench.Type", "", false}});
  Client client(server.port());
  while (server.wanted().empty()) std::this_thread::yield();
  const std::string payload(size, 'x');
  for ([[maybe_unused]] auto _ : state) {
    for (std::size_t i = 0; i < batch; ++i) server.send(1, payload, i);
    client.take(batch);
  }
  if (server.counters().left_out > 0) state.SkipWithError("messages were left out");
  const auto sent = static_cast<std::int64_t>(state.iterations()) * state.range(1);
  state.SetItemsProcessed(sent);
  state.SetBytesProcessed(sent * state.range(0));
}
BENCHMARK(stream)->Args({64, 4096})->Args({10'000, 1024})->Args({921'600, 8})->UseRealTime();

}  // namespace
}  // namespace mimesis::view
