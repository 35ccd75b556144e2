#pragma once
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/runtime/keys.h"
#include "common/runtime/sockets.h"

namespace mimesis::runtime {

/// Connections by which other hosts have sent something, by their key.
class FarConnections {
 public:
  /// Any frame of theirs.
  void note(const Frame& frame);
  /// Ends those of a key.
  void end(const std::string& key);

 private:
  std::map<int, std::pair<std::string, std::string>> found_;  ///< fd -> key, address
};

/// What guards the tcp side of a process: everything that leaves the host is encrypted with CURVE
/// between hosts that trust each other's keys (keys.h); libzmq asks here about a key that knocks
/// (ZAP). Who is refused is named once, on both sides. Loopback and ipc need no keys.
/// Lives longer than the sockets that it serves.
class TcpGate {
 public:
  explicit TcpGate(ZmqContext& context) : context_(context) {}

  /// Binds a socket, after its ipc endpoint, to tcp.
  /// @throws ConfigError if it leaves the host and this host has no key, or it cannot be bound.
  void bind(ZmqSocket& socket, const std::string& endpoint);
  /// Connects. False, said once, if the endpoint is on a host whose key (empty: none) is not
  /// trusted here, or this one has no key. @throws ConfigError if it is no endpoint.
  bool connect(ZmqSocket& socket, const std::string& endpoint, const std::string& host_key);

  /// Answers what libzmq has asked, and tells of refusals.
  void serve();
  /// Keys that were admitted and are not trusted any more; looked at once a second.
  std::vector<std::string> revoked();
  const std::vector<int>& fds() const { return fds_; }  ///< readable: `serve` may have work
  /// Public key of this host if a socket is bound beyond it, else empty.
  const std::string& public_key() const { return bound_key_; }

 private:
  bool has_key();
  /// Empty: it is not trusted. Precondition: has_key().
  std::string name_of(const std::string& host_key);
  void watch(ZmqSocket& socket, int events);
  void answer();
  void say_once(const std::string& line);

  ZmqContext& context_;
  std::optional<KeyPair> key_;
  std::string bound_key_;
  std::map<std::string, std::string> admitted_;          ///< names of other hosts, by key
  std::chrono::steady_clock::time_point look_{};         ///< at the keys, next time
  std::unique_ptr<ZmqSocket> asked_;                     ///< libzmq's questions
  std::map<void*, std::unique_ptr<ZmqSocket>> watched_;  ///< handshakes, by socket
  std::vector<int> fds_;                                 ///< of those two
  std::set<std::string> said_;
};

}  // namespace mimesis::runtime
