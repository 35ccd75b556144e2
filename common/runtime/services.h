#pragma once
#include <chrono>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/error.h"
#include "common/runtime/bus.h"
#include "common/runtime/registry.h"
#include "common/runtime/sockets.h"

namespace mimesis::runtime {

constexpr char kAnswerDone = 0, kAnswerFailed = 1;

/// Answers requests. Frames: identity, request number, service | answer: identity, number, 0 or 1,
/// body or reason. The service "" exchanges NodeInfos with other hosts.
class ServiceServer {
 public:
  explicit ServiceServer(ZmqContext& context) : socket_(context, ZMQ_ROUTER) {}
  ZmqSocket& socket() { return socket_; }

  void add(const std::string& service, Handler handler) { handlers_[service] = std::move(handler); }
  /// Answers all that has arrived.
  void serve() {
    for (Frame identity; socket_.receive_first(identity);) {
      Frame number, service, request;
      if (!identity.more() || !socket_.receive(number)) continue;
      if (!number.more() || !socket_.receive(service)) continue;
      if (!service.more() || !socket_.receive(request) || request.more()) continue;
      const auto result = answer(std::string(service.view()), std::string(request.view()));
      const char status = result ? kAnswerDone : kAnswerFailed;
      Frame kind(std::string_view(&status, 1));
      Frame body(std::string_view(result ? *result : result.error().reason));
      // A client that is gone takes nothing; ROUTER drops the answer.
      if (socket_.send(identity, true) && socket_.send(number, true) && socket_.send(kind, true)) {
        socket_.send(body, false);
      }
    }
  }

 private:
  tl::expected<std::string, Status> answer(const std::string& service, const std::string& request) {
    const auto it = handlers_.find(service);
    if (it == handlers_.end()) return tl::unexpected(Status{"no service " + service + " here"});
    try {
      return it->second(request);
    } catch (const std::exception& e) {
      return tl::unexpected(Status{e.what()});
    }
  }

  ZmqSocket socket_;
  std::map<std::string, Handler> handlers_;
};

/// One server as seen by a client.
class ServiceClient {
 public:
  /// `wait_for_server`: requests wait in the socket until the server is there; else they are lost.
  ServiceClient(ZmqContext& context, const std::string& endpoint, bool wait_for_server)
      : socket_(context, ZMQ_DEALER) {
    socket_.set(ZMQ_IMMEDIATE, wait_for_server ? 0 : 1);
    socket_.connect(endpoint);
  }
  /// Returns the number of the request.
  std::uint64_t send(const std::string& service, const std::string& request) {
    ++number_;
    Frame number(sizeof number_);
    std::memcpy(number.data(), &number_, sizeof number_);
    Frame name{std::string_view(service)};
    Frame body{std::string_view(request)};
    if (socket_.send(number, true) && socket_.send(name, true)) socket_.send(body, false);
    return number_;
  }
  /// Answer to request `number` if it is there. Answers to others (given up) are discarded.
  std::optional<tl::expected<std::string, Status>> receive(std::uint64_t expected) {
    for (Frame number; socket_.receive_first(number);) {
      Frame kind, body;
      if (!number.more() || !socket_.receive(kind) || !kind.more() || !socket_.receive(body))
        continue;
      std::uint64_t n = 0;
      if (number.size() != sizeof n || kind.size() != 1) continue;
      std::memcpy(&n, number.data(), sizeof n);
      if (n != expected) continue;
      std::string text(body.view());
      if (kind.data()[0] == kAnswerDone) return text;
      return tl::unexpected(Status{std::move(text)});
    }
    return std::nullopt;
  }
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
  Peers(ZmqContext& context, const std::vector<std::string>& addresses) {
    for (const std::string& address : addresses) {
      peers_.push_back({.host = host_of(address),
                        .client = std::make_unique<ServiceClient>(context, address, false),
                        .info = std::nullopt});
    }
  }

  /// Changes since the last call; sends requests that are due. `self`: this node, announced to the
  /// peers.
  std::vector<RegistryChange> poll(const v1::NodeInfo& self) {
    std::vector<RegistryChange> changes;
    const auto now = Clock::now();
    for (Peer& peer : peers_) {
      if (const auto answer = peer.client->receive(peer.number); answer && *answer) {
        peer.last_answer = now;
        peer.next_ask = now + kAskAgain;
        take_answer(peer, **answer, changes);
      }
      if (peer.info && now - peer.last_answer > kSilence) {
        changes.push_back({std::move(*peer.info), false});
        peer.info.reset();
      }
      if (now >= peer.next_ask) {
        peer.number = peer.client->send("", self.SerializeAsString());
        peer.next_ask = now + (peer.info ? kAskAgain : kAskUnanswered);
      }
    }
    return changes;
  }
  std::vector<void*> handles() const {
    std::vector<void*> handles;
    for (const Peer& peer : peers_) handles.push_back(peer.client->handle());
    return handles;
  }
  bool empty() const { return peers_.empty(); }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kAskUnanswered{100}, kAskAgain{500}, kSilence{2000};
  static constexpr std::string_view kTcp = "tcp://";
  struct Peer {
    std::string host;
    std::unique_ptr<ServiceClient> client;
    std::uint64_t number = 0;
    Clock::time_point next_ask{}, last_answer{};
    std::optional<v1::NodeInfo> info;
  };
  /// HOST of tcp://HOST:PORT.
  static std::string host_of(const std::string& address) {
    const std::size_t colon = address.rfind(':');
    if (!address.starts_with(kTcp) || colon <= kTcp.size() || colon + 1 == address.size()) {
      throw ConfigError("--peer '" + address + "': expected tcp://HOST:PORT");
    }
    return address.substr(kTcp.size(), colon - kTcp.size());
  }

  /// Leaves only the tcp endpoint, with the host by which the node was reached if it listens
  /// everywhere.
  static void reach_through(const std::string& host,
                            google::protobuf::RepeatedPtrField<std::string>& endpoints) {
    std::string usable;
    for (const std::string& endpoint : endpoints) {
      if (!endpoint.starts_with(kTcp)) continue;
      const bool anywhere =
          endpoint.starts_with("tcp://0.0.0.0:") || endpoint.starts_with("tcp://[::]:");
      usable =
          anywhere ? std::string(kTcp) + host + endpoint.substr(endpoint.rfind(':')) : endpoint;
    }
    endpoints.Clear();
    if (!usable.empty()) *endpoints.Add() = usable;
  }

  void take_answer(Peer& peer, const std::string& answer, std::vector<RegistryChange>& changes) {
    v1::NodeInfo info;
    if (!info.ParseFromString(answer) || info.start_id() == 0) return;
    reach_through(peer.host, *info.mutable_data_endpoints());
    reach_through(peer.host, *info.mutable_reliable_endpoints());
    reach_through(peer.host, *info.mutable_service_endpoints());
    if (peer.info && peer.info->start_id() != info.start_id()) {
      changes.push_back({std::move(*peer.info), false});
      peer.info.reset();
    }
    if (peer.info && peer.info->SerializeAsString() == info.SerializeAsString()) return;
    peer.info = info;
    changes.push_back({std::move(info), true});
  }

  std::vector<Peer> peers_;
};

}  // namespace mimesis::runtime
