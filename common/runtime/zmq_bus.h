#pragma once
#include <chrono>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/runtime/bus.h"
#include "common/runtime/graph_time.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {

/// Where a node's time comes from.
enum class ClockKind { wall, sim, lockstep };

struct BusOptions {
  std::string name;   ///< name of the node: letters, digits, _ and -
  std::string graph;  ///< empty: graph_name()
  ClockKind clock = ClockKind::wall;
  std::map<std::string, std::string, std::less<>> in, out;  ///< wiring: port -> topic
  /// Publisher of an input's topic, or several with commas between; default: the one it names.
  std::map<std::string, std::string, std::less<>> from = {};
  /// Topics that this node publishes even where another one is obeyed alone, which refuses it.
  std::set<std::string, std::less<>> into_live = {};
  /// tcp://ADDRESS:PORT for other hosts, PORT * for any; empty: this host only. Unless it is a
  /// loopback address, it needs a key (keys.h).
  std::string bind;

  /// The node that an input of one author obeys; empty if it is not wired, or (Author::first) if
  /// the first that is alive. @throws ConfigError if several publish its topic.
  std::string obeyed(std::string_view port, Author author) const;
  /// Endpoint of the node's n-th socket: `bind` with its port + n, or any port.
  /// @throws ConfigError unless `bind` is tcp://ADDRESS:PORT.
  std::string tcp_endpoint(int n) const;
  /// With the graph's name. @throws ConfigError if a topic is invalid.
  BusOptions complete() &&;
};

/// Sending end for messages that are serialised already: log player, converters.
class RawOut {
 public:
  virtual ~RawOut() = default;
  /// Like OutChannel::send.
  virtual void send_raw(std::string_view payload, Time stamp) = 0;
  virtual std::size_t subscribers() const = 0;
};

/// The bus of real processes, over ZeroMQ (docs/architecture.md). Single-threaded: everything
/// happens inside the calls below, so its owner must call `wait` or `drain` regularly.
class ZmqBus final : public Bus {
 public:
  using WallTime = GraphTime::WallTime;
  struct Impl;

  /// Takes the name in the graph and binds the sockets.
  /// @throws ConfigError if the name is taken, the directory unsafe, or an address cannot be bound.
  explicit ZmqBus(BusOptions options);
  ~ZmqBus() override;

  std::unique_ptr<InChannel> subscribe(std::string_view port,
                                       const google::protobuf::Message& prototype,
                                       const InOptions& options) override;
  std::unique_ptr<OutChannel> advertise(std::string_view port,
                                        const google::protobuf::Message& prototype,
                                        const OutOptions& options) override;
  void serve(std::string_view name, const google::protobuf::Message& request,
             const google::protobuf::Message& response, Handler handler) override;
  tl::expected<std::string, Status> call(std::string_view service, const std::string& request,
                                         std::chrono::milliseconds timeout) override;
  bool lockstep() const override;
  Outside& outside() override { return outside_; }
  const std::string& node() const override;
  const std::string& directory() const override;

  /// Publishes on `topic` messages of a type known only by its descriptors (a FileDescriptorSet).
  /// @throws ConfigError if the set does not define `type` or the topic is advertised already.
  std::unique_ptr<RawOut> advertise_raw(std::string_view topic, std::string_view type,
                                        std::string_view descriptor_set, const OutOptions& options);

  /// Declares that all ports exist, and waits (at most 2 s) for recorders, so that they miss
  /// nothing: until then messages for reliable subscribers are held back. @throws ConfigError if a
  /// node that is there takes one of its topics from another node alone (unless `into_live` has
  /// it).
  void ready();

  /// A step begins at this graph time: messages that it takes are so much older than their stamps.
  void step_begins(Time now);
  /// Serves discovery, services and late joiners until `deadline` or until one of `fds` is
  /// readable; true in the second case.
  bool wait(WallTime deadline, std::span<const int> fds = {});
  /// Like `wait`, but only until a message can be drained; true then.
  bool wait_message(WallTime deadline);
  /// Moves what has arrived to the inputs. In lock-step use `deliver`.
  void drain();

  /// Lock-step: the step at `tick` begins. Makes exactly `visible` appear at the inputs, in this
  /// order; waits for messages in transit, but not for publishers that died. Of a living one a
  /// message is given up after 5 s, or 0.5 s once `stop_fd` is readable.
  void deliver(Time tick, const google::protobuf::RepeatedPtrField<v1::Publication>& visible,
               int stop_fd);
  /// Lock-step: waits (at most 2 s) until every live lock-step node wired to this one's outputs has
  /// connected, and lets held messages go.
  void connect_members();
  /// Lock-step: messages published since the last call.
  std::vector<v1::Publication> take_published();
  /// Lock-step: waits until no reliable subscriber is behind; gives up after 5 s without progress,
  /// or 0.5 s once `stop_fd` is readable.
  void flush(int stop_fd);

  std::vector<v1::NodeInfo> known_nodes() const;  ///< alive, without this one, by name
  const v1::NodeInfo& info() const;               ///< description of this node
  const GraphTime& time() const;                  ///< the graph's wall clock
  /// Counts of the inputs since the last report.
  std::vector<v1::InputHealth> report_inputs(Time now);
  /// Topics of the inputs that the node does not work without and that nothing has come on.
  std::vector<std::string> awaited() const;
  std::uint64_t sent() const;           ///< messages since the start
  std::uint64_t backlog() const;        ///< messages waiting for reliable subscribers
  std::uint64_t backlog_bytes() const;  ///< size of their payloads
  std::uint64_t overflow() const;       ///< messages a stuck reliable subscriber has missed
  /// Received frames that were no messages of Mimesis, came from a stranger, or were subscriptions
  /// beyond the limit.
  std::uint64_t malformed() const;

 private:
  LiveOutside outside_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mimesis::runtime
