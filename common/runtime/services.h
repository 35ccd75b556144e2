#pragma once
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "common/error.h"
#include "common/runtime/bus.h"
#include "common/runtime/tcp_gate.h"

namespace mimesis::runtime {

constexpr char kAnswerDone = 0, kAnswerFailed = 1;

/// Answers requests. Frames: identity, request number, service | answer: identity, number, 0 or 1,
/// body or reason.
class ServiceServer {
 public:
  explicit ServiceServer(ZmqContext& context) : socket_(context, ZMQ_ROUTER) {}
  ZmqSocket& socket() { return socket_; }

  void add(const std::string& service, Handler handler) { handlers_[service] = std::move(handler); }
  /// Ends the connections of a host.
  void end_connections(const std::string& key) { far_.end(key); }
  /// Answers all that has arrived.
  void serve() {
    for (Frame identity; socket_.receive_first(identity);) {
      far_.note(identity);
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
  FarConnections far_;
  std::map<std::string, Handler> handlers_;
};

/// One server as seen by a client.
class ServiceClient {
 public:
  /// Requests wait in the socket until the server is there. @throws ConfigError if it is no
  /// endpoint, or on a host that is not trusted.
  ServiceClient(ZmqContext& context, TcpGate& gate, const std::string& endpoint,
                const std::string& host_key)
      : socket_(context, ZMQ_DEALER) {
    if (!gate.connect(socket_, endpoint, host_key))
      throw ConfigError(endpoint + " is on a host that is not trusted");
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

}  // namespace mimesis::runtime
