#pragma once
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <type_traits>

#include "common/error.h"
#include "common/time.h"

namespace google::protobuf {
class Message;
}

namespace mimesis::runtime {

/// Which messages an input keeps between two steps.
enum class Policy {
  latest,    ///< only the newest message; older ones are dropped and counted
  queue,     ///< the newest `depth`; older ones are dropped and counted
  reliable,  ///< all messages; the publisher keeps those that do not fit, and reports it
};

/// Whose messages an input takes. One author alone: in its present start, and on the host that it
/// is on. Messages of others are refused, said once per sender, and counted as rejected; a node
/// that would be refused does not start.
enum class Author {
  any,
  /// The topic's publisher in the launch file; without one the first that is alive, and after its
  /// end the next.
  first,
  /// The topic's publisher in the launch file; without one the node that the topic names (NODE of
  /// NODE/PORT), alive or not.
  named,
};

struct InOptions {
  Policy policy = Policy::latest;
  std::size_t depth = 1;  ///< length of the queue of Policy::queue
  /// Inputs that lead to the motion of a robot take one author.
  Author author = Author::any;
  /// The node works without it: `mimesis launch` says nothing if it is not wired.
  bool optional = false;
};

struct OutOptions {
  bool latched = false;  ///< late subscribers get the last message
};

/// One received message, still serialised.
struct Received {
  std::string payload;         ///< Protobuf wire format
  Time stamp{};                ///< graph time at which it was published
  std::uint64_t seq = 0;       ///< number within its publisher and topic, from 1
  std::string source;          ///< name of the publishing node
  std::uint64_t start_id = 0;  ///< distinguishes that node from its predecessors; 0 in memory
};

/// Counters of one input since the start.
struct InCounters {
  std::uint64_t received = 0;
  std::uint64_t lost = 0;      ///< gaps in seq
  std::uint64_t dropped = 0;   ///< by policy
  std::uint64_t rejected = 0;  ///< malformed, or with a NaN or infinity
};

/// Receiving end of one port. The messages of a step are fixed before the step starts.
class InChannel {
 public:
  virtual ~InChannel() = default;
  /// Oldest message not yet taken, or nothing.
  virtual std::optional<Received> pop() = 0;
  /// Tells that a message just popped could not be used; counted and logged (throttled) with `why`.
  virtual void reject(const Received& message, std::string_view why) = 0;
  virtual const InCounters& counters() const = 0;
};

/// Sending end of one port.
class OutChannel {
 public:
  virtual ~OutChannel() = default;
  /// Publishes; never blocks. `stamp`: graph time of the content.
  virtual void send(const google::protobuf::Message& message, Time stamp) = 0;
  /// seq that the next message will carry.
  virtual std::uint64_t next_seq() const = 0;
  /// Subscribers connected now, as far as this side knows.
  virtual std::size_t subscribers() const = 0;
};

/// Serialised request -> serialised response, or a reason. Runs between steps, on the node's
/// thread.
using Handler = std::function<tl::expected<std::string, Status>(const std::string& request)>;

/// A bus or device that a node opens (or would, in a replay), as `mimesis launch --check` sees it.
struct Opening {
  std::string kind;     ///< "can"
  std::string address;  ///< "embedded:arm"
  std::string role{};   ///< "master": of such there is one on a bus; empty: nobody asks
  std::string of{};     ///< what it takes the bus for: ends that say something say the same
};

/// Everything that a step reads from and writes to the world outside of the graph: field buses,
/// devices, the wall clock, threads. All of it passes here, so that it is recorded with the step
/// and a replay gives the same back; without that a node's outputs are no function of its log. Only
/// inside the constructor, `step`, `stop` and handlers of services.
class Outside {
 public:
  virtual ~Outside() = default;
  /// True in a replay: open no device, and take the recorded data.
  virtual bool replaying() const = 0;
  /// Live: records data just read; `name` is its source ("can"), for messages and tools.
  virtual void record(std::string_view name, std::string_view bytes) = 0;
  /// Replay: data read at this place. Empty if the log holds something else here; the replay then
  /// stops with a line.
  virtual std::string replay(std::string_view name) = 0;
  /// Bytes that go out, in both cases: recorded live, compared with the record in a replay.
  virtual void written(std::string_view name, std::string_view bytes) = 0;
  /// True if the node is made for its description alone: replaying, but there is no record.
  virtual bool describing() const { return false; }
  virtual void opens(const Opening&) {}  ///< announces it
};

/// Implementation without a recorder.
class LiveOutside final : public Outside {
 public:
  bool replaying() const override { return false; }
  void record(std::string_view, std::string_view) override {}
  std::string replay(std::string_view) override { return {}; }
  void written(std::string_view, std::string_view) override {}
};

/// The node's connection to its graph: ZeroMQ in processes (`zmq_bus.h`), memory in tests
/// (`common/testing/loopback.h`). A port's name is local to the node; the launch file (or --in,
/// --out) wires it to a topic. Unwired outputs publish on NODE/PORT; unwired inputs receive nothing
/// and log it.
class Bus {
 public:
  virtual ~Bus() = default;

  /// `prototype` gives the type. @throws ConfigError if the port exists already.
  virtual std::unique_ptr<InChannel> subscribe(std::string_view port,
                                               const google::protobuf::Message& prototype,
                                               const InOptions& options) = 0;
  virtual std::unique_ptr<OutChannel> advertise(std::string_view port,
                                                const google::protobuf::Message& prototype,
                                                const OutOptions& options) = 0;

  /// Offers service NODE/`name`.
  virtual void serve(std::string_view name, const google::protobuf::Message& request,
                     const google::protobuf::Message& response, Handler handler) = 0;
  /// Calls a service by its full name; blocks until the answer, the death of the server, or
  /// `timeout` of wall time, whichever comes first. Not for use inside `step`.
  virtual tl::expected<std::string, Status> call(std::string_view service,
                                                 const std::string& request,
                                                 std::chrono::milliseconds timeout) = 0;

  /// True in lock-step: results must not depend on how long anything takes (see Job).
  virtual bool lockstep() const = 0;
  /// All ports exist (PortsEnd): a description needs no more of the node.
  virtual void ports_end() {}
  /// Nothing that follows refuses a parameter: a check needs no more of the node.
  virtual void refusals_end() {}
  virtual Outside& outside() = 0;
  /// Name of the node, for messages.
  virtual const std::string& node() const = 0;
  /// Folder for this graph's sockets ($XDG_RUNTIME_DIR/mimesis/GRAPH): buses of simulated hardware
  /// live here.
  virtual const std::string& directory() const = 0;
};

/// Bytes that `read()` reads from outside, or the recorded ones.
template <class Read>
std::string read_outside(Bus& bus, std::string_view name, Read read) {
  Outside& outside = bus.outside();
  if (outside.replaying()) return outside.replay(name);
  std::string bytes = read();
  outside.record(name, bytes);
  return bytes;
}

/// Like read_outside, for a plain value: a duration on the wall clock, whether a thread is done.
/// Zero where a replay has nothing that fits.
template <class T, class Read>
requires std::is_trivially_copyable_v<T> T read_outside_value(Bus& bus, std::string_view name,
                                                              Read read) {
  const std::string bytes = read_outside(bus, name, [&read] {
    const T value = read();
    return std::string(reinterpret_cast<const char*>(&value), sizeof value);
  });
  T value{};
  if (bytes.size() == sizeof value) std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

}  // namespace mimesis::runtime
