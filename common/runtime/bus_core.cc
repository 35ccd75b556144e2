#include "common/runtime/bus_core.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <climits>

#include "common/error.h"
#include "common/runtime/log.h"
#include "common/runtime/raw.h"
#include "common/runtime/registry.h"

namespace mimesis::runtime {
namespace {

void compare(const v1::NodeInfo& publisher, const v1::NodeInfo& subscriber,
             std::vector<std::string>& lines) {
  for (const v1::TopicInfo& out : publisher.outputs()) {
    for (const v1::TopicInfo& in : subscriber.inputs()) {
      if (in.topic() != out.topic() || in.type_hash() == out.type_hash()) continue;
      std::string line = "topic " + out.topic() + ": node " + publisher.name() + " publishes " +
                         out.type() + ", node " + subscriber.name() + " expects " + in.type();
      if (in.type() == out.type()) line += " with other fields (different builds)";
      lines.push_back(line + "; its messages are ignored");
    }
  }
}

/// One line for every topic on which `self` and `other` are wired together with different types.
/// Symmetric: both nodes find the same pairs.
std::vector<std::string> mismatches(const v1::NodeInfo& self, const v1::NodeInfo& other) {
  std::vector<std::string> lines;
  compare(self, other, lines);
  compare(other, self, lines);
  return lines;
}

using namespace std::chrono_literals;
constexpr auto kGreetingPatience = 2s;
constexpr auto kDrainPeriod = 20ms;
constexpr auto kPeerPeriod = 50ms;
constexpr auto kSettled = 1min;  // a registry more patient than this waits for its descriptor only
constexpr int kHeartbeat_ms = 500, kHeartbeatTimeout_ms = 2000;

std::string_view clock_name(ClockKind clock) {
  constexpr std::array kNames = {"wall", "sim", "lockstep"};
  return kNames.at(static_cast<std::size_t>(clock));
}

/// tcp://ADDRESS:PORT + n; a wildcard port stays one.
std::string port_after(const std::string& address, int n) {
  const std::size_t colon = address.rfind(':');
  if (!address.starts_with("tcp://") || colon <= 5 || colon + 1 == address.size()) {
    throw ConfigError("--bind '" + address + "': expected tcp://ADDRESS:PORT");
  }
  const std::string port = address.substr(colon + 1);
  if (port == "*" || port == "0") return address.substr(0, colon) + ":*";
  const bool digits =
      std::all_of(port.begin(), port.end(), [](char c) { return c >= '0' && c <= '9'; });
  const long number = digits && port.size() < 6 ? std::stol(port) : 0;
  if (number < 1 || number + 2 > 65535) {
    throw ConfigError("--bind '" + address + "': expected a port in [1, 65533]");
  }
  return address.substr(0, colon + 1) + std::to_string(number + n);
}

bool readable(void* socket) {
  int events = 0;
  std::size_t size = sizeof events;
  return zmq_getsockopt(socket, ZMQ_EVENTS, &events, &size) == 0 && (events & ZMQ_POLLIN) != 0;
}

int zmq_fd(void* socket) {
  int fd = -1;
  std::size_t size = sizeof fd;
  zmq_getsockopt(socket, ZMQ_FD, &fd, &size);
  return fd;
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
      registry(directory) {
  for (ZmqSocket* socket :
       {&server.socket(), &publisher.data_socket(), &publisher.reliable_socket()}) {
    served_fds.push_back(zmq_fd(socket->handle()));
  }
  for (void* handle : peers.handles()) served_fds.push_back(zmq_fd(handle));
  // Names of a start are unique: no process reconnects to the socket of a predecessor.
  const std::string stem = "ipc://" + directory + "/" + options.name + "-" +
                           std::to_string(info.start_id() % 100'000'000);
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
    if (registry.nodes().contains(change.node.name()) ||
        change.node.start_id() == info.start_id()) {
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

void ZmqBus::Impl::serve_arrived() {
  publish_info();
  if (!peers.empty()) discover();
  if (readable(publisher.data_socket().handle()) ||
      readable(publisher.reliable_socket().handle()) || publisher.backlog() > 0) {
    publisher.serve();
  }
  if (readable(server.socket().handle())) server.serve();
}

// ZeroMQ's descriptors tell only that something has changed since its events were last looked at:
// so look before every sleep. Cheaper than zmq_poll, and with a deadline in nanoseconds.
ZmqBus::Impl::Woken ZmqBus::Impl::wait(WallTime deadline, std::span<const int> fds, bool messages,
                                       void* reply) {
  waiting_on.clear();
  const auto watch = [this](int fd) { waiting_on.push_back({fd, POLLIN, 0}); };
  for (const int fd : fds) watch(fd);
  watch(registry.fd());  // -1 is ignored
  for (const int fd : served_fds) watch(fd);
  if (messages) {
    watch(zmq_fd(subscriber.data_handle()));
    watch(zmq_fd(subscriber.reliable_handle()));
  }
  if (reply != nullptr) watch(zmq_fd(reply));
  const auto arrived = [&] {
    return (messages &&
            (readable(subscriber.data_handle()) || readable(subscriber.reliable_handle()))) ||
           (reply != nullptr && readable(reply));
  };
  for (;;) {
    serve_arrived();
    if (arrived()) return Woken::message;
    const auto left = std::chrono::nanoseconds(deadline - std::chrono::system_clock::now());
    const auto pause = std::clamp(left, std::chrono::nanoseconds(0), patience(messages));
    const timespec ts{pause.count() / 1'000'000'000, pause.count() % 1'000'000'000};
    const int ready = ppoll(waiting_on.data(), waiting_on.size(), &ts, nullptr);
    if ((ready > 0 && waiting_on[fds.size()].revents != 0) || registry.patience() < kSettled)
      discover();
    for (std::size_t i = 0; ready > 0 && i < fds.size(); ++i) {
      if (waiting_on[i].revents != 0) return Woken::fd;
    }
    if (left.count() <= 0) return Woken::deadline;
  }
}

std::chrono::nanoseconds ZmqBus::Impl::patience(bool messages) {
  auto patience = registry.patience();
  if (publisher.backlog() > 0) patience = std::min(patience, 1ms);
  if (!peers.empty()) patience = std::min<std::chrono::milliseconds>(patience, kPeerPeriod);
  if (drains_while_waiting && !messages) {
    subscriber.drain();
    patience = std::min<std::chrono::milliseconds>(patience, kDrainPeriod);
  }
  return patience;
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
