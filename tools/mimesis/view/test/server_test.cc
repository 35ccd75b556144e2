#include "tools/mimesis/view/server.h"

#include <gtest/gtest.h>

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <memory>
#include <thread>

namespace mimesis::view {
namespace {

namespace beast = boost::beast;
namespace net = boost::asio;
using namespace std::chrono_literals;

/// Listens to a channel, and reads when it is told to.
class Client {
 public:
  explicit Client(std::uint16_t port, int channel = 1, const std::string& target = "/?key=k") {
    socket_.next_layer().connect({net::ip::make_address("127.0.0.1"), port});
    socket_.set_option(beast::websocket::stream_base::decorator([](auto& request) {
      request.set(beast::http::field::sec_websocket_protocol, "foxglove.sdk.v1");
    }));
    socket_.read_message_max(0);
    socket_.handshake("127.0.0.1", target);
    socket_.text(true);
    socket_.write(net::buffer(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":)" +
                              std::to_string(channel) + "}]}"));
  }
  /// The next message; its first byte is '{' of a text.
  std::string next() {
    buffer_.consume(buffer_.size());
    socket_.read(buffer_);
    return {static_cast<const char*>(buffer_.data().data()), buffer_.size()};
  }
  /// The content of the next message of the channel; words about slowness are counted.
  std::string next_of_channel() {
    for (;;) {
      const std::string message = next();
      if (!message.starts_with('{')) return message.substr(13);
      slow_ += message.find("slow") != std::string::npos;
    }
  }
  int slow() const { return slow_; }

 private:
  net::io_context io_;
  beast::websocket::stream<net::ip::tcp::socket> socket_{io_};
  beast::flat_buffer buffer_;
  int slow_ = 0;
};

std::string numbered(std::size_t i, std::size_t size) {
  std::string content = std::to_string(i);
  content.resize(size, ' ');
  return content;
}

/// All sizes, so that messages are gathered, sent from where they are, and wait for room.
TEST(Server, EveryByteComesInOrder) {
  Server server({.name = "test",
                 .port = 0,
                 .key = "k",
                 .page = "/nowhere",
                 .backlog_bytes = std::size_t{1} << 30,
                 .backlog_messages = 1 << 20});
  server.announce(std::vector<Channel>{{1, "t", "T", "", false}});
  Client client(server.port());
  while (server.wanted().empty()) std::this_thread::sleep_for(1ms);
  constexpr std::array<std::size_t, 7> kSizes{8, 100, 30'000, 32'756, 40'000, 300'000, 65};
  constexpr std::size_t kMessages = 700;
  std::thread sender([&] {
    for (std::size_t i = 0; i < kMessages; ++i)
      server.send(1, numbered(i, kSizes[(i * i) % kSizes.size()]), i);
  });
  for (std::size_t i = 0; i < kMessages; ++i)
    ASSERT_EQ(client.next_of_channel(), numbered(i, kSizes[(i * i) % kSizes.size()])) << i;
  sender.join();
  EXPECT_EQ(server.counters().left_out, 0U);
}

TEST(Server, OldMessagesOfASlowClientAreLeftOutAndOthersGetAll) {
  Server server(
      {.name = "test", .port = 0, .key = "k", .page = "/nowhere", .backlog_bytes = 4 << 20});
  server.announce(std::vector<Channel>{{1, "t", "T", "", false}, {2, "u", "T", "", false}});
  Client slow(server.port(), 1), fast(server.port(), 2);
  while (server.wanted().size() < 2) std::this_thread::sleep_for(1ms);
  constexpr std::size_t kMessages = 400, kSize = 200'000;  // 80 MB: more than sockets hold
  for (std::size_t i = 0; i < kMessages; ++i) {
    server.send(1, numbered(i, kSize), i);
    server.send(2, numbered(i, kSize), i);
    ASSERT_EQ(std::stoul(fast.next_of_channel()), i) << "who reads misses nothing";
  }
  EXPECT_GT(server.counters().left_out, kMessages / 2);
  std::size_t last = 0, count = 0;
  while (last + 1 < kMessages) {
    const std::size_t now = std::stoul(slow.next_of_channel());
    ASSERT_TRUE(count++ == 0 || now > last) << "in order";
    last = now;
  }
  EXPECT_LT(count, kMessages);
  EXPECT_EQ(count + server.counters().left_out, kMessages);
  EXPECT_GE(slow.slow(), 1) << "it is told";
  EXPECT_EQ(fast.slow(), 0);
}

/// However many strangers look, those with the key have seats of their own.
TEST(Server, StrangersTakeNoSeatOfTheOwner) {
  Server server({.name = "test", .port = 0, .key = "k", .page = "/nowhere"});
  server.announce(std::vector<Channel>{{1, "t", "T", "", false}});
  std::vector<std::unique_ptr<Client>> strangers;
  try {
    while (strangers.size() < 100)
      strangers.push_back(std::make_unique<Client>(server.port(), 1, "/"));
  } catch (const boost::system::system_error&) {  // 503
  }
  EXPECT_GE(strangers.size(), 8U);
  EXPECT_LT(strangers.size(), 64U);
  Client owner(server.port());
  EXPECT_NE(owner.next().find("serverInfo"), std::string::npos);
  EXPECT_NE(strangers.back()->next().find("serverInfo"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::view
