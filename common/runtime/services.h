#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/runtime/bus.h"
#include "common/runtime/registry.h"
#include "common/runtime/sockets.h"

namespace mimesis::runtime {

/// Answers requests. Frames: identity, request number, service | answer: identity, number, 0 or 1,
/// body or reason. The service "" exchanges NodeInfos with other hosts.
class ServiceServer {
 public:
  explicit ServiceServer(ZmqContext& context) : socket_(context, ZMQ_ROUTER) {}
  ZmqSocket& socket() { return socket_; }

  void add(const std::string& service, Handler handler) { handlers_[service] = std::move(handler); }
  /// Answers all that has arrived.
  void serve();

 private:
  tl::expected<std::string, Status> answer(const std::string& service, const std::string& request);

  ZmqSocket socket_;
  std::map<std::string, Handler> handlers_;
};

/// One server as seen by a client.
class ServiceClient {
 public:
  /// `wait_for_server`: requests wait in the socket until the server is there; else they are lost.
  ServiceClient(ZmqContext& context, const std::string& endpoint, bool wait_for_server);
  /// Returns the number of the request.
  std::uint64_t send(const std::string& service, const std::string& request);
  /// Answer to request `number` if it is there. Answers to others (given up) are discarded.
  std::optional<tl::expected<std::string, Status>> receive(std::uint64_t number);
  void* handle() const { return socket_.handle(); }

 private:
  ZmqSocket socket_;
  std::uint64_t number_ = 0;
};

/// Nodes on other hosts, reached by the address of their service socket. Each gets requests of its
/// NodeInfo until it answers, and then twice a second: silence means that it has ended, a new
/// start_id that it has restarted.
class Peers {
 public:
  /// @throws ConfigError unless every address is tcp://HOST:PORT.
  Peers(ZmqContext& context, const std::vector<std::string>& addresses);

  /// Changes since the last call; sends requests that are due. `self`: this node, announced to the
  /// peers.
  std::vector<RegistryChange> poll(const v1::NodeInfo& self);
  std::vector<void*> handles() const;
  bool empty() const { return peers_.empty(); }

 private:
  using Clock = std::chrono::steady_clock;
  struct Peer {
    std::string host;
    std::unique_ptr<ServiceClient> client;
    std::uint64_t number = 0;
    Clock::time_point next_ask{}, last_answer{};
    std::optional<v1::NodeInfo> info;
  };
  void take_answer(Peer& peer, const std::string& answer, std::vector<RegistryChange>& changes);

  std::vector<Peer> peers_;
};

}  // namespace mimesis::runtime
