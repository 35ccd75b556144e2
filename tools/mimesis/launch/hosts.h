#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/ports.h"
#include "common/runtime/registry.h"
#include "common/runtime/zmq_bus.h"
#include "tools/mimesis/launch/far_host.h"

namespace mimesis::launch {

/// The hosts of a run. Each gets to know the nodes of all the others (FarNodes), through the ssh
/// connections that start at the launcher; messages go directly. With more than this machine the
/// launcher is a node itself, `launcher`, and publishes v1.HostStatus on launcher/hosts.
class Hosts {
 public:
  /// Begins to connect. @throws ConfigError if the launcher cannot be a node: it has no key.
  Hosts(const GraphFile& graph, const Run& run, const std::string& directory);

  NodeHost& of(const NodeSpec& node);
  /// A node of the run has this entry in the graph.
  bool runs(const NodeSpec& node, const v1::NodeInfo& info) const;
  /// A node there can be started; else what is needed for that has begun.
  bool ready(const NodeSpec& node);
  /// What nodes did since the last call.
  std::vector<HostEvent> poll();
  /// @param news  of the graph's directory here
  void tell(const std::vector<runtime::RegistryChange>& news);
  void watch(std::vector<pollfd>& fds) const;
  /// The run is over. Waits at most 2 s for the programs on other hosts.
  void disconnect();
  /// Why the run cannot go on: a host that is not reached at first, or two that do not trust each
  /// other; empty: it can.
  std::string failure();

 private:
  FarHost* far(const NodeSpec& node) const;
  void exchange();
  void publish();

  runtime::GraphTime time_;
  runtime::FarNodes shown_;
  LocalHost here_;
  std::vector<std::unique_ptr<FarHost>> far_;
  /// The launcher in the graph, if there are other hosts.
  struct Node {
    Node(const std::string& graph, const std::string& bind)
        : bus({.name = "launcher", .graph = graph, .in = {}, .out = {}, .bind = bind}),
          out(bus, "hosts") {
      bus.ready();
    }
    runtime::ZmqBus bus;
    runtime::Out<v1::HostStatus> out;
  };
  std::optional<Node> node_;
  WallTime next_status_{};
  bool trust_checked_ = false;  ///< once, when all are there
};

}  // namespace mimesis::launch
