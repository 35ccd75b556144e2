#include "common/runtime/bus_core.h"

#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <climits>

#include "common/error.h"
#include "common/runtime/compatibility.h"
#include "common/runtime/graph_directory.h"
#include "common/runtime/log.h"
#include "common/runtime/raw.h"

namespace mimesis::runtime {
namespace {

using namespace std::chrono_literals;
constexpr auto kGreetingPatience = 2s;
constexpr auto kDrainPeriod = 20ms;
constexpr auto kPeerPeriod = 50ms;
constexpr int kHeartbeat_ms = 500, kHeartbeatTimeout_ms = 2000;

std::string_view clock_name(ClockKind clock) {
  switch (clock) {
    case ClockKind::wall:
      return "wall";
    case ClockKind::sim:
      return "sim";
    case ClockKind::lockstep:
      return "lockstep";
  }
  return "";
}

/// tcp://ADDRESS:PORT + n; a wildcard port stays one.
std::string port_after(const std::string& address, int n) {
  const std::size_t colon = address.rfind(':');
  if (!address.starts_with("tcp://") || colon <= 5 || colon + 1 == address.size()) {
    throw ConfigError("--bind '" + address + "': expected tcp://ADDRESS:PORT");
  }
  const std::string port = address.substr(colon + 1);
  if (port == "*" || port == "0") return address.substr(0, colon) + ":*";
  const bool digits = std::all_of(port.begin(), port.end(), [](char c) { return c >= '0' && c <= '9'; });
  const long number = digits && port.size() < 6 ? std::stol(port) : 0;
  if (number < 1 || number + 2 > 65535) {
    throw ConfigError("--bind '" + address + "': expected a port in [1, 65533]");
  }
  return address.substr(0, colon + 1) + std::to_string(number + n);
}

v1::NodeInfo describe(const BusOptions& options) {
  v1::NodeInfo info;
  info.set_name(options.name);
  std::array<char, HOST_NAME_MAX + 1> host{};
  gethostname(host.data(), host.size() - 1);
  info.set_host(host.data());
  info.set_pid(static_cast<std::uint32_t>(getpid()));
  info.set_start_id(new_start_id());
  std::array<char, PATH_MAX> executable{};
  if (readlink("/proc/self/exe", executable.data(), executable.size() - 1) > 0) {
    info.set_executable(executable.data());
  }
  info.set_clock(std::string(clock_name(options.clock)));
  info.set_started_ns(static_cast<std::uint64_t>(
      std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count()));
  return info;
}

BusOptions complete(BusOptions options) {
  if (options.graph.empty()) options.graph = graph_name();
  for (const auto* wiring : {&options.in, &options.out}) {
    for (const auto& [port, topic] : *wiring) check_topic(topic);
  }
  return options;
}

}  // namespace

ZmqBus::Impl::Impl(BusOptions o)
    : options(complete(std::move(o))),
      directory(graph_directory(options.graph)),
      entry(directory, options.name),
      info(describe(options)),
      publisher(context, info.start_id()),
      subscriber(context, info.start_id(), options.clock == ClockKind::lockstep),
      server(context),
      peers(context, options.peers),
      registry(directory),
      timer(timerfd_create(CLOCK_REALTIME, TFD_NONBLOCK | TFD_CLOEXEC)) {
  MIMESIS_ASSERT(timer >= 0);
  // Names of a start are unique: nobody reconnects to the socket of a predecessor.
  const std::string stem =
      "ipc://" + directory + "/" + options.name + "-" + std::to_string(info.start_id() % 100'000'000);
  const auto bind = [&](ZmqSocket& socket, const char* suffix, int port_offset, auto& endpoints) {
    socket.bind(stem + suffix);
    *endpoints.Add() = stem + suffix;
    if (options.bind.empty()) return;
    socket.set(ZMQ_HEARTBEAT_IVL, kHeartbeat_ms);  // a host may vanish without a word
    socket.set(ZMQ_HEARTBEAT_TIMEOUT, kHeartbeatTimeout_ms);
    socket.bind(port_after(options.bind, port_offset));
    *endpoints.Add() = socket.bound_endpoint();
  };
  bind(server.socket(), ".s", 0, *info.mutable_service_endpoints());
  bind(publisher.data_socket(), ".d", 1, *info.mutable_data_endpoints());
  bind(publisher.reliable_socket(), ".r", 2, *info.mutable_reliable_endpoints());
  server.add("", [this](const std::string& request) -> tl::expected<std::string, Status> {
    v1::NodeInfo asking;
    if (!asking.ParseFromString(request)) return tl::unexpected(Status{"no NodeInfo"});
    for (const std::string& line : mismatches(info, asking)) {
      if (said.emplace(asking.start_id(), line).second) log(Level::error, line);
    }
    return info.SerializeAsString();
  });
}

void ZmqBus::Impl::publish_info() {
  if (!info_changed) return;
  info_changed = false;
  entry.publish(info);
}

void ZmqBus::Impl::serve() {
  publish_info();
  discover();
  publisher.serve();
  server.serve();
}

void ZmqBus::Impl::discover() {
  for (const RegistryChange& change : registry.poll()) {
    if (change.node.start_id() == info.start_id()) continue;
    change.alive ? meet(change.node) : forget(change.node);
  }
  for (const RegistryChange& change : peers.poll(info)) {
    if (registry.nodes().contains(change.node.name()) || change.node.start_id() == info.start_id()) {
      continue;  // a peer on this host is met in the directory
    }
    change.alive ? meet(change.node) : forget(change.node);
  }
}

void ZmqBus::Impl::meet(const v1::NodeInfo& node) {
  known[node.start_id()] = node;
  for (const std::string& line : mismatches(info, node)) {
    if (said.emplace(node.start_id(), line).second) log(Level::error, line);
  }
  subscriber.meet(node);
}

void ZmqBus::Impl::forget(const v1::NodeInfo& node) {
  subscriber.forget(node);
  clients.erase(node.start_id());
  known.erase(node.start_id());
}

ZmqBus::Impl::Woken ZmqBus::Impl::wait(WallTime deadline, std::span<const int> fds, bool messages,
                                       void* reply) {
  const auto since_epoch = std::chrono::nanoseconds(deadline.time_since_epoch());
  itimerspec at{};
  at.it_value.tv_sec = since_epoch.count() / 1'000'000'000;
  at.it_value.tv_nsec = since_epoch.count() % 1'000'000'000;
  timerfd_settime(timer, TFD_TIMER_ABSTIME, &at, nullptr);

  std::vector<zmq_pollitem_t> items;
  const auto watch = [&items](void* socket, int fd) { items.push_back({socket, fd, ZMQ_POLLIN, 0}); };
  for (const int fd : fds) watch(nullptr, fd);
  if (messages) {
    watch(subscriber.data_handle(), 0);
    watch(subscriber.reliable_handle(), 0);
  }
  if (reply != nullptr) watch(reply, 0);
  const std::size_t wakers = items.size();
  watch(nullptr, timer);
  watch(server.socket().handle(), 0);
  watch(publisher.data_socket().handle(), 0);
  watch(publisher.reliable_socket().handle(), 0);
  if (registry.fd() >= 0) watch(nullptr, registry.fd());
  for (void* handle : peers.handles()) watch(handle, 0);

  for (;;) {
    serve();
    auto patience = registry.patience();
    if (publisher.backlog() > 0) patience = std::min(patience, 1ms);
    if (!peers.empty()) patience = std::min<std::chrono::milliseconds>(patience, kPeerPeriod);
    if (drains_while_waiting && !messages) {
      subscriber.drain();
      patience = std::min<std::chrono::milliseconds>(patience, kDrainPeriod);
    }
    const bool late = std::chrono::system_clock::now() >= deadline;
    zmq_poll(items.data(), static_cast<int>(items.size()), late ? 0 : patience.count());
    for (std::size_t i = 0; i < wakers; ++i) {
      if (items[i].revents == 0) continue;
      return i < fds.size() ? Woken::fd : Woken::message;
    }
    if (late) return Woken::deadline;
  }
}

void ZmqBus::Impl::await_greetings(const std::function<bool(const v1::NodeInfo&)>& selects) {
  const auto deadline = std::chrono::system_clock::now() + kGreetingPatience;
  for (;;) {
    serve();
    std::string missing;
    for (const auto& [start_id, node] : known) {
      if (!publisher.greeted_by(start_id) && selects(node)) missing += " " + node.name();
    }
    if (missing.empty()) return;
    if (std::chrono::system_clock::now() >= deadline) {
      warn("still without a connection to{}: first messages may be missing there", missing);
      return;
    }
    wait(std::min(deadline, std::chrono::system_clock::now() + 1ms), {}, false);
  }
}

}  // namespace mimesis::runtime
