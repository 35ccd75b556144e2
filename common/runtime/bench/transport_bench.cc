// Round trips and throughput of typed messages beside raw ZeroMQ on the same kind of socket (ipc,
// PUB/SUB, topic frame + payload), each end with its own context as in two processes; cost of a
// lock-step step with real nodes.
#include <benchmark/benchmark.h>

#include <atomic>
#include <cstring>
#include <optional>
#include <thread>

#include "common/runtime/ports.h"
#include "common/runtime/sockets.h"
#include "common/testing/process.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {
namespace {

using testing::TestGraph;
using testing::TestNode;
using namespace std::chrono_literals;

/// The other end of every case: echoes, or counts.
class OursEcho {
 public:
  explicit OursEcho(const TestGraph& graph) : thread_([this, &graph] { run(graph); }) {}
  ~OursEcho() {
    stop_ = true;
    thread_.join();
  }

 private:
  void run(const TestGraph& graph) {
    TestNode node(graph, {{"in", "ping/x"}}, {{"out", "pong/x"}}, "echo");
    Latest<v1::Publication> in(node.bus(), "in");
    Out<v1::Publication> out(node.bus(), "out");
    node.open();
    v1::Publication copy;
    while (!stop_) {
      node.bus().wait_message(std::chrono::steady_clock::now() + 10ms);
      node.bus().drain();
      if (const v1::Publication* m = in.take()) {
        copy = *m;
        out.send(copy, in.stamp());
      }
    }
  }
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

void ours_round_trip(benchmark::State& state) {
  TestGraph graph;
  TestNode node(graph, {{"in", "pong/x"}}, {{"out", "ping/x"}}, "ping");
  Latest<v1::Publication> in(node.bus(), "in");
  Out<v1::Publication> out(node.bus(), "out");
  node.open();
  OursEcho echo(graph);
  if (!node.wait_subscriber(out)) return state.SkipWithError("no echo");
  v1::Publication m;
  m.set_topic(std::string(static_cast<std::size_t>(state.range(0)), 'x'));
  // The way back is open when the first one returns.
  node.until([&] {
    out.send(m, Time(1));
    return in.take() != nullptr;
  });
  for ([[maybe_unused]] auto _ : state) {
    out.send(m, Time(1));
    do {
      node.bus().wait_message(std::chrono::steady_clock::now() + 1s);
      node.bus().drain();
    } while (in.take() == nullptr);
  }
}

void ours_throughput(benchmark::State& state) {
  TestGraph graph;
  std::atomic<std::uint64_t> received{0};
  std::atomic<bool> stop{false};
  std::thread sink([&] {
    TestNode node(graph, {{"in", "flood/x"}}, {}, "sink");
    auto in = node.bus().subscribe("in", v1::Publication::default_instance(),
                                   {.policy = Policy::reliable});
    node.open();
    while (!stop) {
      node.bus().wait_message(std::chrono::steady_clock::now() + 10ms);
      node.bus().drain();
      while (const auto message = in->pop()) {
        v1::Publication m;
        benchmark::DoNotOptimize(m.ParseFromString(message->payload));
        ++received;
      }
    }
  });
  TestNode node(graph, {}, {{"out", "flood/x"}}, "flood");
  Out<v1::Publication> out(node.bus(), "out");
  node.open();
  node.wait_subscriber(out);
  v1::Publication m;
  m.set_topic(std::string(static_cast<std::size_t>(state.range(0)), 'x'));
  std::uint64_t sent = 0;
  for ([[maybe_unused]] auto _ : state) {
    out.send(m, Time(1));
    // No more messages in flight than the sockets hold: the backlog is for stopped subscribers, not
    // for floods.
    for (++sent; node.bus().backlog() > 32; std::this_thread::yield()) {
      node.bus().wait(std::chrono::steady_clock::now());
    }
  }
  node.until([&] { return received == sent; });
  if (received != sent) state.SkipWithError("lost messages");
  stop = true;
  sink.join();
  state.SetItemsProcessed(state.iterations());
  state.SetBytesProcessed(state.iterations() * state.range(0));
}

bool wait_readable(ZmqSocket& socket) {
  zmq_pollitem_t item{socket.handle(), 0, ZMQ_POLLIN, 0};
  return zmq_poll(&item, 1, 10) > 0;
}

struct RawEnd {
  RawEnd(const std::string& mine, const std::string& other, int high_water)
      : pub(context, ZMQ_XPUB), sub(context, ZMQ_SUB) {
    pub.set(ZMQ_SNDHWM, high_water);
    pub.set(ZMQ_XPUB_NODROP, 1);
    sub.set(ZMQ_RCVHWM, high_water);
    sub.set(ZMQ_SUBSCRIBE, std::string_view("x"));
    pub.bind(mine);
    sub.connect(other);
    Frame subscribed;
    while (!pub.receive(subscribed)) wait_readable(pub);
  }
  bool send(std::string_view payload) {
    Frame topic{std::string_view("x")}, body(payload);
    return pub.send(topic, true) && pub.send(body, false);
  }
  std::optional<Frame> receive() {
    Frame topic, body;
    if (!sub.receive(topic) || !sub.receive(body)) return std::nullopt;
    return body;
  }
  ZmqContext context;
  ZmqSocket pub, sub;
};

void zmq_round_trip(benchmark::State& state) {
  TestGraph graph;
  const std::string a = "ipc://" + graph.directory() + "/a",
                    b = "ipc://" + graph.directory() + "/b";
  std::atomic<bool> stop{false};
  std::thread echo([&] {
    RawEnd end(b, a, 1000);
    while (!stop) {
      if (wait_readable(end.sub)) {
        if (auto body = end.receive()) end.send(body->view());
      }
    }
  });
  RawEnd end(a, b, 1000);
  const std::string payload(static_cast<std::size_t>(state.range(0)), 'x');
  for ([[maybe_unused]] auto _ : state) {
    end.send(payload);
    while (!end.receive()) wait_readable(end.sub);
  }
  stop = true;
  echo.join();
}

void zmq_throughput(benchmark::State& state) {
  TestGraph graph;
  const std::string a = "ipc://" + graph.directory() + "/a",
                    b = "ipc://" + graph.directory() + "/b";
  std::atomic<std::uint64_t> received{0};
  std::atomic<bool> stop{false};
  std::thread sink([&] {
    RawEnd end(b, a, 1000);
    while (!stop) {
      while (end.receive()) ++received;
      wait_readable(end.sub);
    }
  });
  RawEnd end(a, b, 1000);
  const std::string payload(static_cast<std::size_t>(state.range(0)), 'x');
  std::uint64_t sent = 0;
  for ([[maybe_unused]] auto _ : state) {
    while (!end.send(payload)) std::this_thread::yield();
    ++sent;
  }
  while (received < sent) std::this_thread::yield();
  stop = true;
  sink.join();
  state.SetItemsProcessed(state.iterations());
  state.SetBytesProcessed(state.iterations() * state.range(0));
}

/// Three real nodes in a ring at 200, 200 and 100 Hz; time per step of one node.
void lockstep_step(benchmark::State& state) {
  for ([[maybe_unused]] auto _ : state) {
    TestGraph graph;
    std::vector<std::unique_ptr<testing::Process>> nodes;
    const std::vector<std::vector<std::string>> ring{
        {"one", "three/out", "200"}, {"two", "one/out", "200"}, {"three", "two/out", "100"}};
    for (const auto& n : ring) {
      nodes.push_back(std::make_unique<testing::Process>(
          graph, MIMESIS_COUNTER,
          std::vector<std::string>{"--name", n[0], "--clock", "lockstep", "--in", "a=" + n[1],
                                   "--set", "rate_hz=" + n[2]}));
    }
    TestNode watch(graph, {{"time", "clock/time"}}, {}, "watch");
    Reliable<v1::ClockTime> time(watch.bus(), "time");
    watch.open();
    testing::Process clock(graph, "mimesis_clock",
                           {"--set", "participants=one,two,three", "--set", "until_s=20"});
    const auto first = watch.receive(time);
    auto last = first;
    while (last && !last->ended()) {
      if (auto next = watch.receive(time)) last = std::move(next);
    }
    if (!first || !last) return state.SkipWithError("no time");
    constexpr double kStepsPerSimulatedSecond = 500.0;
    const double wall_s = 1e-9 * static_cast<double>(last->wall_ns() - first->wall_ns());
    const double simulated_s = 1e-9 * static_cast<double>(last->time_ns() - first->time_ns());
    state.SetIterationTime(wall_s / (simulated_s * kStepsPerSimulatedSecond));
  }
}

BENCHMARK(ours_round_trip)
    ->Name("round_trip/ours")
    ->Arg(64)
    ->Arg(1024)
    ->Arg(1 << 20)
    ->UseRealTime();
BENCHMARK(zmq_round_trip)
    ->Name("peer/zmq/round_trip")
    ->Arg(64)
    ->Arg(1024)
    ->Arg(1 << 20)
    ->UseRealTime();
BENCHMARK(ours_throughput)
    ->Name("throughput/ours")
    ->Arg(64)
    ->Arg(1024)
    ->Arg(1 << 20)
    ->UseRealTime();
BENCHMARK(zmq_throughput)
    ->Name("peer/zmq/throughput")
    ->Arg(64)
    ->Arg(1024)
    ->Arg(1 << 20)
    ->UseRealTime();
BENCHMARK(lockstep_step)
    ->Name("lockstep/step")
    ->UseManualTime()
    ->Iterations(1)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace mimesis::runtime
