#pragma once
#include <chrono>
#include <map>

#include "common/runtime/sockets.h"

namespace mimesis::runtime {

/// Reliable subscribers of this host that a signal has stopped (SIGSTOP, Ctrl-Z). One whose socket
/// is full holds up all others of its topics, in lock-step all of time. Who computes for long, or
/// is looked at in a debugger, is waited for.
class StoppedSubscribers {
 public:
  using Clock = std::chrono::steady_clock;
  /// A subscription of theirs.
  void note(const Frame& subscription);
  /// Call while others wait. Ends connections of those that have been stopped for 3 s of looking;
  /// once they go on they connect again, and count what they have missed.
  void look(Clock::time_point now);

 private:
  struct Peer {
    int pid = 0;
    Clock::duration stopped{};
  };
  std::map<int, Peer> by_fd_;  ///< of connections, which may have ended
  Clock::time_point looked_{};
};

}  // namespace mimesis::runtime
