#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <thread>

#include "common/runtime/ports.h"
#include "common/runtime/zmq_bus.h"
#include "common/testing/process.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {
namespace {

using testing::Process;
using testing::TestGraph;
using testing::TestNode;
using namespace std::chrono_literals;

constexpr const char* kCounter = MIMESIS_COUNTER;

std::string numbered(std::uint64_t n) {
  v1::Publication m;
  m.set_seq(n);
  return m.SerializeAsString();
}

double seconds_of(const std::function<void()>& action) {
  const auto begin = std::chrono::steady_clock::now();
  action();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// A server on a thread of its own, for as long as it lives.
class Server {
 public:
  Server(const TestGraph& graph, Handler handler)
      : thread_([this, &graph, handler = std::move(handler)] {
          ZmqBus bus({.name = "server", .graph = graph.name(), .in = {}, .out = {}, .bind = {}});
          bus.serve("do", v1::Publication::default_instance(), v1::Publication::default_instance(),
                    handler);
          bus.ready();
          while (!stop_) bus.wait(std::chrono::steady_clock::now() + 5ms);
        }) {}
  ~Server() {
    stop_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

TEST(Services, ACallWaitsForTheServerToAppear) {
  TestGraph graph;
  TestNode client(graph, {}, {}, "client");
  client.open();
  Process server(graph, kCounter, {});
  const auto answer = client.bus().call("counter/add_one", numbered(41), 10s);
  ASSERT_TRUE(answer) << answer.error().reason;
  v1::Publication m;
  ASSERT_TRUE(m.ParseFromString(*answer));
  EXPECT_EQ(m.seq(), 42U);
}

TEST(Services, NobodyThereIsReportedWhenTheTimeIsUp) {
  TestGraph graph;
  TestNode client(graph, {}, {}, "client");
  const double took = seconds_of([&] {
    const auto answer = client.bus().call("nobody/do", "", 100ms);
    ASSERT_FALSE(answer);
    EXPECT_EQ(answer.error().reason, "no node offers service nobody/do within 100 ms");
  });
  EXPECT_GE(took, 0.099);
  EXPECT_LT(took, 0.150);
}

TEST(Services, ASlowServerIsReportedWhenTheTimeIsUp) {
  TestGraph graph;
  std::atomic<bool> go{false};
  Server server(graph, [&](const std::string&) -> tl::expected<std::string, Status> {
    while (!go) std::this_thread::yield();
    return "late";
  });
  TestNode client(graph, {}, {}, "client");
  ASSERT_TRUE(client.until([&] {
    client.bus().wait(std::chrono::steady_clock::now() + 1ms);
    return !client.bus().known_nodes().empty() && client.bus().known_nodes()[0].ready();
  }));
  const double took = seconds_of([&] {
    const auto answer = client.bus().call("server/do", "", 100ms);
    ASSERT_FALSE(answer);
    EXPECT_EQ(answer.error().reason, "service server/do: no answer from node server within 100 ms");
  });
  go = true;
  EXPECT_GE(took, 0.099);
  EXPECT_LT(took, 0.150);
}

TEST(Services, AFailureCarriesItsReason) {
  TestGraph graph;
  Server server(graph, [](const std::string& request) -> tl::expected<std::string, Status> {
    if (request.empty()) throw std::runtime_error("thrown");
    return tl::unexpected(Status{"no path to " + request});
  });
  TestNode client(graph, {}, {}, "client");
  EXPECT_EQ(client.bus().call("server/do", "goal", 5s).error().reason, "no path to goal");
  EXPECT_EQ(client.bus().call("server/do", "", 5s).error().reason, "thrown");
}

TEST(Services, TheDeathOfTheServerEndsACallEarly) {
  TestGraph graph;
  TestNode client(graph, {}, {}, "client");
  client.open();
  Process server(graph, kCounter, {});
  ASSERT_TRUE(client.bus().call("counter/add_one", numbered(1), 10s));
  server.signal(SIGSTOP);
  std::thread killer([&] {  // once the call is under way: it cannot be answered
    std::this_thread::yield();
    server.signal(SIGKILL);
  });
  const double took = seconds_of([&] {
    const auto answer = client.bus().call("counter/add_one", numbered(1), 5s);
    ASSERT_FALSE(answer);
    EXPECT_TRUE(answer.error().reason == "service counter/add_one: node counter died" ||
                answer.error().reason.starts_with("no node offers"))
        << answer.error().reason;
  });
  killer.join();
  EXPECT_LT(took, 5.1);
  server.wait();
  Process again(graph, kCounter, {});
  EXPECT_TRUE(client.bus().call("counter/add_one", numbered(1), 10s)) << again.errors();
}

}  // namespace
}  // namespace mimesis::runtime
