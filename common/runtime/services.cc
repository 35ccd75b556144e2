#include "common/runtime/services.h"

#include <cstring>

#include "common/error.h"

namespace mimesis::runtime {
namespace {
constexpr char kDone = 0, kFailed = 1;

using namespace std::chrono_literals;
constexpr auto kAskUnanswered = 100ms;
constexpr auto kAskAgain = 500ms;
constexpr auto kSilence = 2s;
constexpr std::string_view kTcp = "tcp://";

/// HOST of tcp://HOST:PORT.
std::string host_of(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  if (!address.starts_with(kTcp) || colon <= kTcp.size() || colon + 1 == address.size()) {
    throw ConfigError("--peer '" + address + "': expected tcp://HOST:PORT");
  }
  return address.substr(kTcp.size(), colon - kTcp.size());
}

/// Leaves only the tcp endpoint, with the host by which the node was reached if it listens
/// everywhere.
void reach_through(const std::string& host,
                   google::protobuf::RepeatedPtrField<std::string>& endpoints) {
  std::string usable;
  for (const std::string& endpoint : endpoints) {
    if (!endpoint.starts_with(kTcp)) continue;
    const bool anywhere =
        endpoint.starts_with("tcp://0.0.0.0:") || endpoint.starts_with("tcp://[::]:");
    usable = anywhere ? std::string(kTcp) + host + endpoint.substr(endpoint.rfind(':')) : endpoint;
  }
  endpoints.Clear();
  if (!usable.empty()) *endpoints.Add() = usable;
}

}  // namespace

tl::expected<std::string, Status> ServiceServer::answer(const std::string& service,
                                                        const std::string& request) {
  const auto it = handlers_.find(service);
  if (it == handlers_.end()) return tl::unexpected(Status{"no service " + service + " here"});
  try {
    return it->second(request);
  } catch (const std::exception& e) {
    return tl::unexpected(Status{e.what()});
  }
}

void ServiceServer::serve() {
  for (Frame identity; socket_.receive(identity);) {
    Frame number, service, request;
    if (!identity.more() || !socket_.receive(number)) continue;
    if (!number.more() || !socket_.receive(service)) continue;
    if (!service.more() || !socket_.receive(request)) continue;
    if (request.more()) {
      socket_.skip_rest(request);
      continue;
    }
    const auto result = answer(std::string(service.view()), std::string(request.view()));
    const char status = result ? kDone : kFailed;
    Frame kind(std::string_view(&status, 1));
    Frame body(std::string_view(result ? *result : result.error().reason));
    // A client that is gone takes nothing; ROUTER drops the answer.
    if (socket_.send(identity, true) && socket_.send(number, true) && socket_.send(kind, true)) {
      socket_.send(body, false);
    }
  }
}

ServiceClient::ServiceClient(ZmqContext& context, const std::string& endpoint, bool wait_for_server)
    : socket_(context, ZMQ_DEALER) {
  socket_.set(ZMQ_IMMEDIATE, wait_for_server ? 0 : 1);
  socket_.connect(endpoint);
}

std::uint64_t ServiceClient::send(const std::string& service, const std::string& request) {
  ++number_;
  Frame number(sizeof number_);
  std::memcpy(number.data(), &number_, sizeof number_);
  Frame name{std::string_view(service)};
  Frame body{std::string_view(request)};
  if (socket_.send(number, true) && socket_.send(name, true)) socket_.send(body, false);
  return number_;
}

std::optional<tl::expected<std::string, Status>> ServiceClient::receive(std::uint64_t expected) {
  for (Frame number; socket_.receive(number);) {
    Frame kind, body;
    if (!number.more() || !socket_.receive(kind) || !kind.more() || !socket_.receive(body))
      continue;
    socket_.skip_rest(body);
    std::uint64_t n = 0;
    if (number.size() != sizeof n || kind.size() != 1) continue;
    std::memcpy(&n, number.data(), sizeof n);
    if (n != expected) continue;
    std::string text(body.view());
    if (kind.data()[0] == kDone) return text;
    return tl::unexpected(Status{std::move(text)});
  }
  return std::nullopt;
}

Peers::Peers(ZmqContext& context, const std::vector<std::string>& addresses) {
  for (const std::string& address : addresses) {
    peers_.push_back({.host = host_of(address),
                      .client = std::make_unique<ServiceClient>(context, address, false),
                      .info = std::nullopt});
  }
}

std::vector<RegistryChange> Peers::poll(const v1::NodeInfo& self) {
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

void Peers::take_answer(Peer& peer, const std::string& answer,
                        std::vector<RegistryChange>& changes) {
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

std::vector<void*> Peers::handles() const {
  std::vector<void*> handles;
  for (const Peer& peer : peers_) handles.push_back(peer.client->handle());
  return handles;
}

}  // namespace mimesis::runtime
