#include "common/runtime/far_nodes.h"

#include <algorithm>

#include "common/error.h"
#include "common/runtime/keys.h"
#include "common/runtime/log.h"

namespace mimesis::runtime {
namespace {

/// Leaves only the tcp endpoint.
void reach_through(const std::string& address,
                   google::protobuf::RepeatedPtrField<std::string>& endpoints) {
  std::string usable;
  for (const std::string& endpoint : endpoints) {
    if (!endpoint.starts_with("tcp://")) continue;
    const bool anywhere =
        endpoint.starts_with("tcp://0.0.0.0:") || endpoint.starts_with("tcp://[::]:");
    usable = anywhere ? tcp_at(address) + endpoint.substr(endpoint.rfind(':')) : endpoint;
  }
  endpoints.Clear();
  if (!usable.empty()) *endpoints.Add() = usable;
}

}  // namespace

v1::NodeInfo seen_from_afar(v1::NodeInfo node, const std::string& address) {
  for (auto* endpoints : {node.mutable_data_endpoints(), node.mutable_reliable_endpoints(),
                          node.mutable_service_endpoints()}) {
    reach_through(address, *endpoints);
  }
  return node;
}

void FarNodes::show(const v1::NodeInfo& node) {
  try {
    Shown& shown = shown_[node.name()];
    if (!shown.entry) {
      shown.entry =
          std::make_unique<RegistryEntry>(directory_, node.name(), std::chrono::milliseconds(0));
    }
    shown.start_id = node.start_id();
    shown.entry->publish(node);
  } catch (const ConfigError& e) {
    shown_.erase(node.name());
    if (refused_.insert(node.start_id()).second)
      warn("node {} of host {} is not seen here: {}", node.name(), node.host(), e.what());
  }
}

bool FarNodes::shows(std::uint64_t start_id) const {
  return std::ranges::any_of(shown_,
                             [&](const auto& shown) { return shown.second.start_id == start_id; });
}

}  // namespace mimesis::runtime
