// Nodes of other hosts, and the keys that they need.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "common/runtime/keys.h"
#include "common/runtime/log.h"
#include "common/runtime/ports.h"
#include "common/runtime/registry.h"
#include "common/runtime/sockets.h"
#include "common/runtime/zmq_bus.h"
#include "common/testing/process.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {
namespace {

using testing::TestGraph;
using namespace std::chrono_literals;

/// A sender on another host, reached at one address over and over.
struct FarSender {
  FarSender(const TestGraph& graph, const std::string& bind)
      : bus({.name = "sender",
             .graph = graph.name(),
             .in = {},
             .out = {{"out", "sender/x"}},
             .bind = bind}),
        out(bus, "out") {
    bus.serve(
        "do", v1::Publication::default_instance(), v1::Publication::default_instance(),
        [](const std::string& request) -> tl::expected<std::string, Status> { return request; });
    bus.ready();
  }
  ZmqBus bus;
  Out<v1::Publication> out;
};

/// A receiver that knows the sender as a node of another host.
struct FarReceiver {
  FarReceiver(const TestGraph& graph, FarSender& sender, const std::string& name = "receiver")
      : far(graph.directory()),
        bus({.name = name,
             .graph = graph.name(),
             .in = {{"in", "sender/x"}, {"command", "sender/x"}},
             .out = {},
             .bind = {}}),
        in(bus, "in"),
        command(bus.subscribe("command", v1::Publication::default_instance(),
                              {.policy = Policy::reliable, .author = Author::named})) {
    far.show(seen_from_afar(sender.bus.info(), "0.0.0.0"));
    while (bus.known_nodes().empty()) bus.wait(std::chrono::steady_clock::now() + 1ms);
  }
  /// Until a message has come, larger than what strangers may say; false after `most`.
  bool hears(FarSender& sender, std::chrono::milliseconds most = 10s) {
    const auto deadline = std::chrono::steady_clock::now() + most;
    while (std::chrono::steady_clock::now() < deadline) {
      sender.bus.wait(std::chrono::steady_clock::now() + 1ms);
      bus.wait(std::chrono::steady_clock::now() + 1ms);
      v1::Publication m;
      m.set_topic(std::string(200'000, 't'));
      if (sender.out.subscribers() > 0) sender.out.send(m, 1s);
      bus.drain();
      if (in.pop()) return true;
    }
    return false;
  }
  FarNodes far;
  ZmqBus bus;
  Reliable<v1::Publication> in;
  std::unique_ptr<InChannel> command;
};

TEST(FarNodes, AreSeenByTcpAloneAtTheAddressOfTheirHost) {
  v1::NodeInfo node;
  for (const char* endpoint : {"ipc:///run/x.d", "tcp://[::]:7001"})
    node.add_data_endpoints(endpoint);
  node.add_service_endpoints("tcp://0.0.0.0:7000");
  node.add_reliable_endpoints("tcp://10.0.0.9:7002");
  const v1::NodeInfo seen = seen_from_afar(node, "fd00::2");
  ASSERT_EQ(seen.data_endpoints_size(), 1);
  EXPECT_EQ(seen.data_endpoints(0), "tcp://[fd00::2]:7001");
  EXPECT_EQ(seen.service_endpoints(0), "tcp://[fd00::2]:7000");
  EXPECT_EQ(seen.reliable_endpoints(0), "tcp://10.0.0.9:7002");
  EXPECT_TRUE(leaves_host(seen.data_endpoints(0)));
  EXPECT_FALSE(leaves_host("tcp://[::1]:7001"));
  EXPECT_FALSE(leaves_host("tcp://127.3.2.1:7001"));
}

TEST(FarNodes, MeetOverTcpAreObeyedAndMeetAgainAfterARestart) {
  TestGraph here, there;  // two directories: they can meet over tcp only
  auto sender = std::make_unique<FarSender>(there, "tcp://127.0.0.1:*");
  const std::string endpoint = sender->bus.info().service_endpoints(1);
  ASSERT_TRUE(endpoint.starts_with("tcp://127.0.0.1:")) << endpoint;
  FarReceiver receiver(here, *sender);
  ASSERT_TRUE(receiver.hears(*sender));
  EXPECT_TRUE(receiver.command->pop()) << "its publisher is on another host";
  const auto nodes = receiver.bus.known_nodes();
  ASSERT_EQ(nodes.size(), 1U);
  EXPECT_EQ(nodes[0].service_endpoints(0), endpoint);
  receiver.far.hide("sender");
  sender.reset();
  sender = std::make_unique<FarSender>(there, endpoint);
  receiver.far.show(seen_from_afar(sender->bus.info(), ""));
  EXPECT_TRUE(receiver.hears(*sender));
  EXPECT_EQ(receiver.bus.known_nodes()[0].start_id(), sender->bus.info().start_id());
}

TEST(FarNodes, LeaveANameToANodeOfThisHost) {
  TestGraph here, there;
  FarSender ours(here, ""), theirs(there, "tcp://127.0.0.1:*");
  FarNodes far(here.directory());
  ::testing::internal::CaptureStderr();
  for (int i = 0; i < 2; ++i) far.show(seen_from_afar(theirs.bus.info(), ""));
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("node sender of host"), std::string::npos) << said;
  EXPECT_EQ(said.find('\n'), said.size() - 1) << "once: " << said;
  EXPECT_FALSE(far.shows(theirs.bus.info().start_id()));
  EXPECT_EQ(GraphView(here.name()).nodes().at(0).start_id(), ours.bus.info().start_id());
}

/// A home of keys; the processes of a test take theirs when they first need it.
class Keys : public ::testing::Test {
 protected:
  ~Keys() override {
    std::filesystem::remove_all(folder_);
    unsetenv("XDG_CONFIG_HOME");
  }
  std::string home(const std::string& host) {
    const std::string path = folder_ + "/" + host;
    setenv("XDG_CONFIG_HOME", path.c_str(), 1);
    return path;
  }
  static int lines(const std::string& text) {
    return static_cast<int>(std::ranges::count(text, '\n'));
  }
  const std::string folder_ =
      (std::filesystem::temp_directory_path() / ("keys-" + std::to_string(getpid()))).string();
};

TEST_F(Keys, AreNoOptionsOfACommand) {
  home("there");
  for (int i = 0; i < 300; ++i) EXPECT_NE(make_key(true).public_key.front(), '-');
}

// 0.0.0.0 leaves the host by its name, and is this one for connect(2).
TEST_F(Keys, WhatLeavesAHostIsForThoseWhoTrustEachOther) {
  TestGraph here, there;
  home("there");
  EXPECT_THROW(FarSender(there, "tcp://0.0.0.0:*"), ConfigError) << "it has no key";
  const KeyPair theirs = make_key(false);
  EXPECT_THROW(make_key(false), ConfigError);
  FarSender sender(there, "tcp://0.0.0.0:*");
  home("here");
  const KeyPair ours = make_key(false);
  ::testing::internal::CaptureStderr();
  {
    FarReceiver receiver(here, sender);
    EXPECT_FALSE(receiver.hears(sender, 300ms)) << "its key is not trusted";
  }
  std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_EQ(lines(said), 1) << said;
  EXPECT_NE(said.find("mimesis key trust HOST '" + theirs.public_key + "'"), std::string::npos);

  trust_key("there", theirs.public_key);
  ::testing::internal::CaptureStderr();
  FarReceiver receiver(here, sender);
  home("there");                          // whom it trusts
  trust_key("there", theirs.public_key);  // for the receiver: all of this process look here now
  EXPECT_FALSE(receiver.hears(sender, 1500ms));
  EXPECT_EQ(sender.out.subscribers(), 0U);
  said = ::testing::internal::GetCapturedStderr();
  EXPECT_EQ(lines(said), 2) << "a line on each side: " << said;
  EXPECT_NE(said.find("is refused: its key '" + ours.public_key), std::string::npos) << said;
  EXPECT_NE(said.find("does not trust this host"), std::string::npos) << said;

  trust_key("here", ours.public_key);
  home("here");
  FarReceiver again(here, sender, "again");
  home("there");
  EXPECT_TRUE(again.hears(sender));

  ::testing::internal::CaptureStderr();
  EXPECT_EQ(untrust_key("here"), std::vector{ours.public_key});
  for (int i = 0; i < 500 && sender.out.subscribers() > 0; ++i) {
    again.hears(sender, 10ms);
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_EQ(sender.out.subscribers(), 0U) << "its connections have ended";
  said = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("host here is not trusted any more"), std::string::npos) << said;
  EXPECT_THROW(untrust_key("here"), ConfigError);
}

TEST_F(Keys, OfALineThatIsNoneAreSaidAndOfAFileThatOthersWriteAreNotTrusted) {
  home("here");
  const std::string key = make_key(false).public_key;
  trust_key("there", key);
  const std::filesystem::path file =
      std::filesystem::path(std::getenv("XDG_CONFIG_HOME")) / "mimesis/trusted";
  std::ofstream(file, std::ios::app) << "\xef\xbb\xbf" << key << " marked\n# a comment\n";
  ::testing::internal::CaptureStderr();
  for (int i = 0; i < 2; ++i) EXPECT_EQ(trusted_keys().size(), 1U);
  using enum std::filesystem::perms;
  permissions(file, group_write, std::filesystem::perm_options::add);
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(trusted_keys().empty());
  EXPECT_THROW(trust_key("there", key), ConfigError);
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_EQ(lines(said), 2) << said;
  EXPECT_NE(said.find("trusted:2: ignored, expected a key of 40"), std::string::npos) << said;
  EXPECT_NE(said.find("other users may write it"), std::string::npos) << said;
}

TEST_F(Keys, AStrangerWithoutKeysGetsNothingAndIsNamedOnce) {
  TestGraph there;
  home("there");
  make_key(false);
  FarSender sender(there, "tcp://0.0.0.0:*");
  ::testing::internal::CaptureStderr();
  ZmqContext context;
  ZmqSocket stranger(context, ZMQ_SUB);
  stranger.set(ZMQ_SUBSCRIBE, "");
  stranger.connect(sender.bus.info().data_endpoints(1));
  take_log_lines();
  std::vector<LogLine> lines;
  const auto serve = [&](std::chrono::milliseconds most, std::size_t enough) {
    const auto deadline = std::chrono::steady_clock::now() + most;
    while (std::chrono::steady_clock::now() < deadline && lines.size() < enough) {
      v1::Publication m;
      sender.out.send(m, 1s);
      sender.bus.wait(std::chrono::steady_clock::now() + 5ms);
      for (LogLine& line : take_log_lines()) lines.push_back(std::move(line));
    }
  };
  serve(10s, 1);
  serve(500ms, 2);  // it tries again and again
  Frame frame;
  EXPECT_FALSE(stranger.receive(frame));
  const std::string said = ::testing::internal::GetCapturedStderr();
  ASSERT_EQ(lines.size(), 1U) << said;
  EXPECT_NE(lines[0].text.find("without showing a key"), std::string::npos) << said;
}

TEST_F(Keys, AFileThatOthersReadIsRefused) {
  const std::string path = home("a") + "/mimesis/key";
  EXPECT_FALSE(own_key());
  const KeyPair made = make_key(false);
  EXPECT_EQ(own_key()->public_key, made.public_key);
  EXPECT_EQ(std::filesystem::status(path).permissions(), std::filesystem::perms(0600));
  std::filesystem::permissions(path, std::filesystem::perms(0640));
  EXPECT_THROW(own_key(), ConfigError);
  EXPECT_THROW(trust_key("b", "short"), ConfigError);
}

TEST(GraphTime, AllOfAHostFollowWhoSetsIt) {
  TestGraph graph;
  GraphTime one(graph.directory());
  const GraphTime other(graph.directory());
  const Time before = one.offset();
  one.set_offset(before + 5s);
  EXPECT_EQ(other.offset(), before + 5s);
  EXPECT_EQ(other.when(before + 5s), GraphTime::WallTime{});
  EXPECT_EQ(GraphTime(graph.directory()).offset(), before + 5s);
  std::ifstream file(graph.directory() + "/wall_clock");  // as Python reads it
  std::int64_t line = 0;
  file >> line;
  EXPECT_EQ(Time(line), before + 5s);
}

TEST(Bind, BadAddressesAreRefused) {
  TestGraph graph;
  EXPECT_THROW(FarSender(graph, "127.0.0.1:5000"), ConfigError);
  EXPECT_THROW(FarSender(graph, "tcp://127.0.0.1:70000"), ConfigError);
}

}  // namespace
}  // namespace mimesis::runtime
