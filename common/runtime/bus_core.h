#pragma once
#include <poll.h>

#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "common/runtime/publisher.h"
#include "common/runtime/registry.h"
#include "common/runtime/services.h"
#include "common/runtime/subscriber.h"
#include "common/runtime/zmq_bus.h"

namespace mimesis::runtime {

/// The parts of ZmqBus put together: its sockets, its entry in the graph, the other nodes.
struct ZmqBus::Impl {
  explicit Impl(BusOptions o);

  /// Serves all pending subscriptions and requests of other nodes.
  void serve();
  /// Waits for `deadline`, for a readable fd, or (`messages`) for a message to drain.
  enum class Woken { deadline, fd, message };
  std::chrono::nanoseconds patience(bool messages);  ///< longest sleep before the next look
  void serve_arrived();
  Woken wait(WallTime deadline, std::span<const int> fds, bool messages, void* reply = nullptr);
  void discover();
  void meet(const v1::NodeInfo& node);
  void forget(const v1::NodeInfo& node);
  void publish_info();
  /// Waits (at most 2 s) until all that `selects` chooses among the living have greeted the
  /// reliable socket.
  void await_greetings(const std::function<bool(const v1::NodeInfo&)>& selects);
  void check_wiring() const;
  std::string topic_of_output(std::string_view port) const;
  /// @throws ConfigError if the node publishes the topic already.
  Publisher::Topic& add_output(std::string_view port, const std::string& topic,
                               const std::string& type, std::uint64_t hash, std::string descriptors,
                               bool latched);
  void send(Publisher::Topic& topic, const std::string& name, bool latched, Frame payload,
            Time stamp);
  const v1::NodeInfo* server_of(std::string_view service) const;

  BusOptions options;
  std::string directory;
  RegistryEntry entry;
  v1::NodeInfo info;
  ZmqContext context;  // before the sockets: destroyed after them
  Publisher publisher;
  Subscriber subscriber;
  ServiceServer server;
  Peers peers;
  Registry registry;
  std::map<std::uint64_t, v1::NodeInfo> known;  ///< alive, without this one, by start_id
  std::map<std::uint64_t, std::unique_ptr<ServiceClient>> clients;
  std::map<std::string, std::shared_ptr<Input>, std::less<>> inputs;  ///< wired ones, by port
  std::set<std::string, std::less<>> in_ports, out_ports;
  std::set<std::pair<std::uint64_t, std::string>> said;  ///< mismatches, once per start
  std::vector<v1::Publication> published;
  Time tick{};
  std::vector<int> served_fds;     ///< file descriptors of the sockets that are always served
  std::vector<pollfd> waiting_on;  ///< descriptors of the current wait
  bool info_changed = true;
  bool drains_while_waiting = false;  ///< a queue could overflow in the socket between slow steps
  bool behind = false;                ///< flush() gave up
};

}  // namespace mimesis::runtime
