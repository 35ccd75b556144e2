#include "common/runtime/tcp_gate.h"

#include <sys/resource.h>
#include <sys/socket.h>

#include <array>
#include <cstring>

#include "common/error.h"
#include "common/runtime/log.h"

namespace mimesis::runtime {
namespace {

constexpr int kHeartbeat_ms = 500, kHeartbeatTimeout_ms = 2000;  // a host may vanish without a word
constexpr int kConnect_ms = 1000;    // tcp itself doubles its pauses while a host is away
constexpr int kHandshake_ms = 5000;  // who says nothing for longer is no node
constexpr std::string_view kNoKey = ": this host has no key; make one: mimesis key new";
constexpr std::string_view kThisHost = "this host";
constexpr std::size_t kMostRefusals = 100;

int fd_of(const ZmqSocket& socket) {
  int fd = -1;
  std::size_t size = sizeof fd;
  zmq_getsockopt(socket.handle(), ZMQ_FD, &fd, &size);
  return fd;
}

/// Connections of strangers take descriptors until their handshake fails: without any left this
/// process could not even look into the graph's directory.
void allow_many_connections() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

/// Asked for only where it is meant: names would become IPv6 addresses where nodes listen to IPv4.
int is_ipv6(const std::string& endpoint) { return endpoint.starts_with("tcp://[") ? 1 : 0; }

}  // namespace

namespace {

/// "" if it is no connection.
std::string address_of_peer(int fd) {
  sockaddr_storage peer{};
  socklen_t size = sizeof peer;
  if (getpeername(fd, reinterpret_cast<sockaddr*>(&peer), &size) != 0) return {};
  return {reinterpret_cast<const char*>(&peer), size};
}

}  // namespace

void FarConnections::note(const Frame& frame) {
  std::string key = frame.peer_key();
  if (key.empty()) return;
  const int fd = frame.connection();
  if (std::string peer = address_of_peer(fd); !peer.empty())
    found_[fd] = {std::move(key), std::move(peer)};
}

void FarConnections::end(const std::string& key) {
  std::erase_if(found_, [&](const auto& entry) {
    const auto& [fd, from] = entry;
    if (from.first != key) return false;
    // The descriptor may be another connection's by now.
    if (address_of_peer(fd) == from.second) shutdown(fd, SHUT_RDWR);
    return true;
  });
}

bool TcpGate::has_key() {
  if (!key_) key_ = own_key();
  return key_.has_value();
}

std::string TcpGate::name_of(const std::string& host_key) {
  if (host_key == key_->public_key) return std::string(kThisHost);
  const auto trusted = trusted_keys();  // read again: who is trusted now need not start us again
  const auto known = trusted.find(host_key);
  return known != trusted.end() ? known->second : "";
}

void TcpGate::bind(ZmqSocket& socket, const std::string& endpoint) {
  socket.set(ZMQ_IPV6, is_ipv6(endpoint));
  socket.set(ZMQ_HEARTBEAT_IVL, kHeartbeat_ms);
  socket.set(ZMQ_HEARTBEAT_TIMEOUT, kHeartbeatTimeout_ms);
  if (leaves_host(endpoint)) {
    if (!has_key()) throw ConfigError("--bind " + endpoint + std::string(kNoKey));
    if (!asked_) {
      asked_ = std::make_unique<ZmqSocket>(context_, ZMQ_REP);
      asked_->bind("inproc://zeromq.zap.01");
      fds_.push_back(fd_of(*asked_));
      allow_many_connections();
    }
    socket.set(ZMQ_CURVE_SERVER, 1);
    socket.set(ZMQ_CURVE_SECRETKEY, key_->secret_key);
    socket.set(ZMQ_HANDSHAKE_IVL, kHandshake_ms);
    bound_key_ = key_->public_key;
    // It depends on who hangs up first.
    watch(socket, ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL);
  }
  socket.bind(endpoint);
}

bool TcpGate::connect(ZmqSocket& socket, const std::string& endpoint, const std::string& host_key) {
  const bool far = leaves_host(endpoint);
  if (far && !has_key()) {
    say_once("nodes of other hosts are not heard" + std::string(kNoKey));
    return false;
  }
  if (far && name_of(host_key).empty()) {
    say_once(endpoint.substr(0, endpoint.rfind(':')) + " is not listened to: its key '" + host_key +
             "' is not trusted here (mimesis key trust HOST '" + host_key + "')");
    return false;
  }
  if (endpoint.starts_with("tcp://")) {
    socket.set(ZMQ_IPV6, is_ipv6(endpoint));
    socket.set(ZMQ_HEARTBEAT_IVL, kHeartbeat_ms);
    socket.set(ZMQ_HEARTBEAT_TIMEOUT, kHeartbeatTimeout_ms);
    socket.set(ZMQ_CONNECT_TIMEOUT, kConnect_ms);
  }
  if (far) {
    if (host_key != key_->public_key) admitted_[host_key] = name_of(host_key);
    socket.set(ZMQ_CURVE_SERVERKEY, host_key);
    socket.set(ZMQ_CURVE_PUBLICKEY, key_->public_key);
    socket.set(ZMQ_CURVE_SECRETKEY, key_->secret_key);
    watch(socket, ZMQ_EVENT_HANDSHAKE_FAILED_AUTH);
  } else {
    socket.set(ZMQ_CURVE_SERVER, 0);  // no keys; endpoints before keep theirs
  }
  socket.connect(endpoint);
  return true;
}

void TcpGate::watch(ZmqSocket& socket, int events) {
  std::unique_ptr<ZmqSocket>& watched = watched_[socket.handle()];
  if (watched) return;
  const std::string name = "inproc://handshakes-" + std::to_string(watched_.size());
  MIMESIS_ASSERT(zmq_socket_monitor(socket.handle(), name.c_str(), events) == 0);
  watched = std::make_unique<ZmqSocket>(context_, ZMQ_PAIR);
  watched->connect(name);
  fds_.push_back(fd_of(*watched));
}

void TcpGate::serve() {
  if (asked_) answer();
  for (auto& [socket, events] : watched_) {
    for (Frame event; events->receive_first(event);) {
      std::uint16_t number = 0;
      std::memcpy(&number, event.data(), std::min(sizeof number, event.size()));
      Frame endpoint;
      if (!event.more() || !events->receive(endpoint)) continue;
      if (number != ZMQ_EVENT_HANDSHAKE_FAILED_AUTH) {
        say_once("somebody knocks at " + std::string(endpoint.view()) +
                 " without showing a key, and is refused");
      } else {
        const std::string_view address = endpoint.view();
        say_once(std::string(address.substr(0, address.rfind(':'))) +
                 " does not trust this host; there: mimesis key trust HOST '" + key_->public_key +
                 "'");
      }
    }
  }
}

void TcpGate::answer() {
  for (Frame version; asked_->receive_first(version);) {
    // request id, domain, address, identity, mechanism, credentials (RFC 27)
    std::array<Frame, 6> rest;
    std::size_t n = 0;
    while (n < rest.size() && asked_->receive(rest[n])) ++n;
    std::array<char, 41> knocking{};
    const bool key_shown = n == rest.size() && rest[5].size() == 32;
    if (key_shown)
      zmq_z85_encode(knocking.data(), reinterpret_cast<const std::uint8_t*>(rest[5].data()), 32);
    const std::string name = name_of(knocking.data());
    const bool welcome = !name.empty();
    if (welcome && name != kThisHost) admitted_[knocking.data()] = name;
    if (!welcome) {
      say_once(std::string(rest[2].view()) + " is refused: its key '" + knocking.data() +
               "' is not trusted here (mimesis key trust HOST '" + knocking.data() + "')");
    }
    const std::array<std::string, 6> reply{"1.0",
                                           std::string(rest[0].view()),
                                           welcome ? "200" : "400",
                                           welcome ? "OK" : "key not trusted",
                                           knocking.data(),
                                           ""};
    for (std::size_t i = 0; i < reply.size(); ++i) {
      Frame frame{std::string_view(reply[i])};
      asked_->send(frame, i + 1 < reply.size());
    }
  }
}

std::vector<std::string> TcpGate::revoked() {
  std::vector<std::string> gone;
  const auto now = std::chrono::steady_clock::now();
  if (admitted_.empty() || now < look_) return gone;
  look_ = now + std::chrono::seconds(1);
  const auto trusted = trusted_keys();
  std::erase_if(admitted_, [&](const auto& host) {
    if (trusted.contains(host.first)) return false;
    warn("host {} is not trusted any more: its connections end (key '{}')", host.second,
         host.first);
    gone.push_back(host.first);
    return true;
  });
  return gone;
}

void TcpGate::say_once(const std::string& line) {
  if (said_.size() < kMostRefusals && said_.insert(line).second) warn("{}", line);
}

}  // namespace mimesis::runtime
