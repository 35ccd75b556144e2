#include <fmt/format.h>

#include <algorithm>

#include "common/error.h"
#include "common/runtime/raw.h"
#include "common/runtime/registry.h"
#include "common/runtime/zmq_bus.h"

namespace mimesis::runtime {

BusOptions BusOptions::complete() && {
  if (graph.empty()) graph = graph_name();
  for (const auto* wiring : {&in, &out}) {
    for (const auto& [port, topic] : *wiring) check_topic(topic);
  }
  return std::move(*this);
}

std::string BusOptions::obeyed(std::string_view port, Author author) const {
  const auto wired = in.find(port);
  if (wired == in.end() || author == Author::any) return {};
  const auto publisher = from.find(port);
  if (publisher == from.end()) {
    return author == Author::first ? "" : wired->second.substr(0, wired->second.find('/'));
  }
  if (publisher->second.find(',') != std::string::npos) {
    throw ConfigError(
        fmt::format("--in {}={}: this input obeys one node, and the topic is published by {}", port,
                    wired->second, publisher->second));
  }
  return publisher->second;
}

std::string BusOptions::tcp_endpoint(int n) const {
  const std::size_t colon = bind.rfind(':');
  if (!bind.starts_with("tcp://") || colon <= 5 || colon + 1 == bind.size()) {
    throw ConfigError("--bind '" + bind + "': expected tcp://ADDRESS:PORT");
  }
  const std::string port = bind.substr(colon + 1);
  if (port == "*" || port == "0") return bind.substr(0, colon) + ":*";
  const bool digits =
      std::all_of(port.begin(), port.end(), [](char c) { return c >= '0' && c <= '9'; });
  const long number = digits && port.size() < 6 ? std::stol(port) : 0;
  if (number < 1 || number + 2 > 65535) {
    throw ConfigError("--bind '" + bind + "': expected a port in [1, 65533]");
  }
  return bind.substr(0, colon + 1) + std::to_string(number + n);
}

}  // namespace mimesis::runtime
