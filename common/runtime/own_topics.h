#pragma once
#include <algorithm>
#include <array>
#include <string_view>

namespace mimesis::runtime {

// Topics NODE/PORT on which the runtime reports about the process of a node, beside the node's own
// outputs. They differ between runs that are equal otherwise.

inline constexpr std::string_view kHealthPort = "health";  ///< v1.Health, once a second
inline constexpr std::string_view kLogPort = "log";        ///< foxglove.Log
inline constexpr std::string_view kStartPort = "start";    ///< v1.NodeStart, latched
inline constexpr std::string_view kStepsPort = "steps";    ///< v1.StepLog

/// Whether `topic` is that of `port`, of any node.
constexpr bool is_own_topic(std::string_view topic, std::string_view port) {
  const std::size_t slash = topic.rfind('/');
  return slash != topic.npos && topic.substr(slash + 1) == port;
}

/// Whether `topic` is that of any of these ports.
constexpr bool is_own_topic(std::string_view topic) {
  constexpr std::array kPorts{kHealthPort, kLogPort, kStartPort, kStepsPort};
  return std::ranges::any_of(kPorts,
                             [&](std::string_view port) { return is_own_topic(topic, port); });
}

}  // namespace mimesis::runtime
