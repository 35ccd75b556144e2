#include "common/runtime/peers.h"

#include "common/error.h"

namespace mimesis::runtime {
namespace {

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
