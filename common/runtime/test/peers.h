#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <string>

#include "common/runtime/registry.h"
#include "common/runtime/sockets.h"
#include "common/runtime/wire.h"
#include "common/runtime/zmq_bus.h"
#include "common/testing/process.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {

using testing::TestGraph;
using testing::TestNode;

/// Serves both nodes until `done`.
template <class Done>
bool both(TestNode& a, TestNode& b, Done done,
          std::chrono::milliseconds timeout = std::chrono::seconds(10)) {
  return a.until(
      [&] {
        b.until([] { return true; });
        b.bus().wait(std::chrono::steady_clock::now());
        return done();
      },
      timeout);
}

inline v1::Publication numbered(std::uint64_t n) {
  v1::Publication m;
  m.set_seq(n);
  return m;
}

/// A publisher of t/x that speaks for itself, announced as node "t" of this process, or of `pid`.
struct Liar {
  Liar(const TestGraph& graph, const std::string& endpoint, pid_t pid = getpid())
      : entry(graph.directory(), "t") {
    socket.set(ZMQ_XPUB_VERBOSER, 1);  // tells of ends of connections though there is a new one
    if (endpoint.starts_with("ipc://")) socket.bind(endpoint);
    v1::NodeInfo info;
    info.set_name("t");
    info.set_pid(static_cast<std::uint32_t>(pid));
    info.set_start_id(kStart);
    info.add_data_endpoints(endpoint);
    v1::TopicInfo& output = *info.add_outputs();
    output.set_topic("t/x");
    output.set_type_hash(kHash);
    entry.publish(info);
  }
  /// True once a connection takes it.
  bool send(std::uint64_t seq, std::size_t size = 1) {
    Frame header(std::string_view(
        encode_frame("t/x", {.seq = seq, .type_hash = kHash, .start_id = kStart})));
    Frame payload(size);
    for (Frame subscribed; socket.receive(subscribed);) connected = true;
    return connected && socket.send(header, true) && socket.send(payload, false);
  }
  static constexpr std::uint64_t kStart = 5;
  const std::uint64_t kHash = type_hash(*v1::Publication::descriptor());
  ZmqContext context;
  ZmqSocket socket{context, ZMQ_XPUB};
  RegistryEntry entry;
  bool connected = false;
};

/// A node whose input hears t/x.
struct Listener {
  explicit Listener(Author author = Author::any)
      : in(node.bus().subscribe("in", v1::Publication::default_instance(),
                                {.policy = Policy::queue, .depth = 100, .author = author})) {
    node.open();
  }
  /// Numbers of what arrives until `count` messages have been received or refused.
  std::string until(std::uint64_t count) {
    EXPECT_TRUE(
        node.until([&] { return in->counters().received + in->counters().rejected >= count; }));
    std::string seqs;
    while (const auto got = in->pop()) seqs += std::to_string(got->seq) + " ";
    return seqs;
  }
  TestGraph graph;
  const std::string endpoint = "ipc://" + graph.directory() + "/liar";
  TestNode node{graph, {{"in", "t/x"}}, {}, "receiver"};
  std::unique_ptr<InChannel> in;
};

}  // namespace mimesis::runtime
