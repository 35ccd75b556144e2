// Strangers whose messages are too large, or never end.
#include "common/runtime/message_limit.h"

#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "common/runtime/ports.h"
#include "common/runtime/test/peers.h"

namespace mimesis::runtime {
namespace {

using namespace std::chrono_literals;

TEST(MessageLimit, FramesHaveALimit) {
  Listener listener;
  Liar liar(listener.graph, listener.endpoint);
  ASSERT_TRUE(listener.node.until([&] { return liar.send(1); }));
  EXPECT_EQ(listener.until(1), "1 ");
  ASSERT_TRUE(liar.send(2, kLargestMessage + 1));
  EXPECT_TRUE(listener.node.until([&] {  // its subscriptions end with the connection
    Frame message;
    return liar.socket.receive(message) && message.view().front() == 0;
  }));
  EXPECT_EQ(listener.in->counters().received, 1U);
  EXPECT_EQ(listener.node.bus().malformed(), 1U);

  Out<v1::Publication> out(listener.node.bus(), "out");
  auto m = numbered(1);
  m.set_topic(std::string(kLargestMessage, 'x'));
  out.send(m, 1s);
  EXPECT_EQ(listener.node.bus().overflow(), 1U) << "what nobody would take is not sent";
}

TEST(MessageLimit, AMessageOfManyFramesIsRefusedAndEndsItsConnection) {
  Listener listener;
  Liar liar(listener.graph, listener.endpoint);
  ASSERT_TRUE(listener.node.until([&] { return liar.send(1); }));
  EXPECT_EQ(listener.until(1), "1 ");
  Frame header(std::string_view(
      encode_frame("t/x", {.seq = 2, .type_hash = liar.kHash, .start_id = Liar::kStart})));
  ASSERT_TRUE(liar.socket.send(header, true));
  for (int i = 100'000; i > 0; --i) {
    Frame part(std::size_t{0});
    ASSERT_TRUE(liar.socket.send(part, i > 1));
  }
  EXPECT_TRUE(listener.node.until([&] {  // its subscriptions end with the connection
    Frame message;
    return liar.socket.receive(message) && message.view().front() == 0;
  }));
  EXPECT_EQ(listener.node.bus().malformed(), 1U);
  std::uint64_t seq = 2;
  EXPECT_TRUE(listener.node.until([&] {  // it connects again, and the next message is one
    liar.send(++seq);
    return listener.in->counters().received > 1;
  }));
  EXPECT_EQ(listener.node.bus().malformed(), 1U);
}

/// A connection to a Unix socket that says what no libzmq says.
struct RawPeer {
  explicit RawPeer(const std::string& endpoint) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strcpy(address.sun_path, endpoint.substr(std::strlen("ipc://")).c_str());
    EXPECT_EQ(connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    const timeval patience{.tv_sec = 5, .tv_usec = 0};
    setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  }
  ~RawPeer() { close(fd); }
  RawPeer(const RawPeer&) = delete;
  RawPeer& operator=(const RawPeer&) = delete;
  static std::string greeting(char version = 3) {
    std::string bytes = "\xff" + std::string(8, '\0') + "\x7f" + version;
    bytes += std::string("\0NULL", 5);
    bytes.resize(64);
    return bytes;
  }
  /// Greets as a socket of this type; messages come behind both handshakes.
  void greet(const std::string& type) const {
    const std::string ready =
        std::string("\5READY\13Socket-Type\0\0\0", 21) + static_cast<char>(type.size()) + type;
    say(greeting() + "\4" + static_cast<char>(ready.size()) + ready);
    std::array<char, 256> theirs{};
    EXPECT_EQ(recv(fd, theirs.data(), 66, MSG_WAITALL), 66);
    EXPECT_EQ(recv(fd, theirs.data(), static_cast<std::size_t>(theirs[65]), MSG_WAITALL),
              theirs[65]);
  }
  /// Repeats `bytes` until the other end closes or takes nothing for 5 s; number of bytes sent, at
  /// most `most` and the rest of a repetition.
  std::size_t say(std::string_view bytes, std::size_t most = 1) const {
    std::size_t sent = 0;
    while (sent < most || sent % bytes.size() != 0) {
      const std::string_view rest = bytes.substr(sent % bytes.size());
      const ssize_t n = ::send(fd, rest.data(), rest.size(), MSG_NOSIGNAL);
      if (n < 0) break;
      sent += static_cast<std::size_t>(n);
    }
    return sent;
  }
  int fd = socket(AF_UNIX, SOCK_STREAM, 0);
};

TEST(MessageLimit, AMessageThatNeverEndsIsCutAtItsLimit) {
  Listener listener;
  const v1::NodeInfo& info = listener.node.bus().info();
  std::string empty_parts, large_parts("\3\0\0\0\0\0\1\0\0", 9);  // flags: more; more, long
  for (int i = 0; i < 5000; ++i) empty_parts += std::string("\1\0", 2);
  large_parts.resize(9 + (1U << 16U));
  const auto used = [] {
    const auto m = mallinfo2();
    return m.uordblks + m.hblkhd;
  };
  ::testing::internal::CaptureStderr();
  for (const auto& [endpoint, type] :
       {std::pair(info.service_endpoints(0), "DEALER"), std::pair(info.data_endpoints(0), "SUB"),
        std::pair(info.reliable_endpoints(0), "SUB")}) {
    for (const auto& [parts, most] : {std::pair(empty_parts, kLargestMessage / 16),
                                      std::pair(large_parts, 4 * kLargestMessage)}) {
      const RawPeer peer(endpoint);
      peer.greet(type);
      const std::size_t before = used();
      EXPECT_LT(peer.say(parts, most), most) << type;
      EXPECT_TRUE(listener.node.until([&] { return used() < before + kLargestMessage / 4; }));
    }
  }
  // Subscribers' large frames are cut by libzmq.
  EXPECT_TRUE(listener.node.until([&] { return listener.node.bus().malformed() == 4; }));
  listener.node.bus().wait(std::chrono::steady_clock::now());
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("a connection of process " + std::to_string(getpid()) + " was closed"),
            std::string::npos)
      << said;
  EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
}

TEST(MessageLimit, AStrangersFirstFrameIsSmallAndOfZmtp3) {
  Listener listener;
  const std::string endpoint = listener.node.bus().info().service_endpoints(0);
  const std::string large("\6\0\0\0\0\0\1\0\1", 9);  // a command of 64 KiB and a byte
  const RawPeer peer(endpoint), old(endpoint);
  peer.say(RawPeer::greeting() + large);
  old.say(RawPeer::greeting(1));
  EXPECT_TRUE(listener.node.until([&] { return listener.node.bus().malformed() == 2; }));
}

}  // namespace
}  // namespace mimesis::runtime
