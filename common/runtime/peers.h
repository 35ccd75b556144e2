#pragma once
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/registry.h"
#include "common/runtime/services.h"

namespace mimesis::runtime {

/// Nodes on other hosts, reached by the address of their service socket. Each is asked for its
/// NodeInfo until it answers, and then twice a second: silence means that it is gone, a new
/// start_id that it has restarted.
class Peers {
 public:
  /// @throws ConfigError unless every address is tcp://HOST:PORT.
  Peers(ZmqContext& context, const std::vector<std::string>& addresses);

  /// What changed; asks again where it is time. `self`: this node, told to the peers.
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
