#pragma once
#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {

/// Hears the nodes' signs of life, in the protocol of systemd (sd_notify(3), WATCHDOG=1), on a
/// socket of its own. The kernel says which process sent one.
class Watchdog {
 public:
  /// A node that is silent for this long is named.
  static constexpr std::chrono::milliseconds kNamed{900};

  /// @throws std::runtime_error without a socket.
  Watchdog();
  /// What a node needs to know.
  std::vector<std::pair<std::string, std::string>> environment() const;
  int fd() const { return socket_.get(); }  ///< readable when a sign has come
  /// The process of the next sign, if one has come.
  std::optional<pid_t> next();

 private:
  Fd socket_;
  std::string address_;  ///< as in $NOTIFY_SOCKET
};

/// What a process does, from /proc: "stopped by a signal", "waits for the disk", ...
std::string activity(pid_t pid);

}  // namespace mimesis::launch
