#pragma once
#include <gtest/gtest.h>
#include <sys/types.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/node_clock.h"
#include "common/runtime/ports.h"
#include "common/runtime/raw.h"
#include "common/runtime/zmq_bus.h"

namespace mimesis::testing {

using namespace std::chrono_literals;

/// A graph of its own for one test; its directory is removed at the end.
class TestGraph {
 public:
  TestGraph();
  ~TestGraph();
  TestGraph(const TestGraph&) = delete;
  TestGraph& operator=(const TestGraph&) = delete;

  const std::string& name() const { return name_; }
  const std::string& directory() const { return directory_; }

 private:
  std::string name_, directory_;
};

// Limits of waits are those of a quiet machine (MachineTime): a busy one makes tests slower, not
// wrong.

/// A running program. Killed at the end if it still runs.
class Process {
 public:
  /// `program`: a path, or a name in build/bin. Arguments as on a command line.
  Process(const std::string& program, const std::vector<std::string>& arguments);
  /// A node in `graph`: adds --graph.
  Process(const TestGraph& graph, const std::string& program, std::vector<std::string> arguments);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// Until node `name` of `graph` is ready; false if the process ended or `timeout` passed first.
  bool wait_ready(const TestGraph& graph, const std::string& name,
                  std::chrono::milliseconds timeout = 10s);
  void signal(int number) const;
  /// Exit code, 128 + signal if it was killed, nothing if it still runs after `timeout`.
  std::optional<int> wait(std::chrono::milliseconds timeout = 10s);
  /// SIGTERM, then `wait`.
  std::optional<int> terminate();

  pid_t pid() const { return pid_; }
  std::string output() const;  ///< standard output so far
  std::string errors() const;  ///< standard error so far

 private:
  pid_t pid_ = -1;
  int pidfd_ = -1, out_ = -1, err_ = -1;
  std::optional<int> status_;
};

/// Calls of the program `mimesis`; what the last one said is kept.
class VerbTest : public ::testing::Test {
 protected:
  /// Its exit code; -1: it still runs after `timeout`.
  int call(const std::vector<std::string>& words, std::chrono::milliseconds timeout = 60s) {
    Process process("mimesis", words);
    const int code = process.wait(timeout).value_or(-1);
    output_ = process.output();
    errors_ = process.errors();
    return code;
  }
  std::string output_, errors_;
};

/// The test's own node in `graph`, on the wall clock or in lock-step: declare ports, `open()`, then
/// send and receive.
///   TestNode peer(graph, {{"reply", "echo/out"}}, {{"request", "test/request"}});
///   runtime::Reliable<v1::X> reply(peer.bus(), "reply");
///   runtime::Out<v1::X> request(peer.bus(), "request");
///   peer.open();
class TestNode {
 public:
  using Wiring = std::map<std::string, std::string, std::less<>>;
  TestNode(const TestGraph& graph, Wiring in, Wiring out, std::string name = "test",
           runtime::ClockKind clock = runtime::ClockKind::wall);

  runtime::ZmqBus& bus() { return *bus_; }
  void open() { bus_->ready(); }
  /// Instead of `open`, for a TestNode constructed with `lockstep`: time (node mimesis_clock, with
  /// this node among its participants) then stands still but in `until`, however busy the machine.
  void open_lockstep(double rate_hz, double offset_s = 0.0);
  /// Serves the bus until `done()`; false after `timeout`, of graph time. `done` is called whenever
  /// messages have arrived and at least every 2 ms; in lock-step once a step.
  bool until(const std::function<bool()>& done, std::chrono::milliseconds timeout = 10s);
  /// Next message of a Queue or Reliable port.
  template <class Port>
  auto receive(Port& port, std::chrono::milliseconds timeout = 10s) {
    decltype(port.pop()) message;
    until([&] { return (message = port.pop()).has_value(); }, timeout);
    return message;
  }
  /// Waits until `out` has a subscriber: earlier messages are lost, as on any publisher.
  template <class Out>
  bool wait_subscriber(Out& out, std::chrono::milliseconds timeout = 10s) {
    return until([&] { return out.subscribers() > 0; }, timeout);
  }
  static runtime::Time now();        ///< wall time
  runtime::Time graph_time() const;  ///< time of the step in lock-step, else wall time

 private:
  bool until_in_lockstep(const std::function<bool()>& done, runtime::Time timeout);

  std::unique_ptr<runtime::ZmqBus> bus_;
  std::unique_ptr<runtime::NodeClock> clock_;  ///< in lock-step
};

}  // namespace mimesis::testing
