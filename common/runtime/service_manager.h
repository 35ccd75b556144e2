#pragma once
#include <chrono>
#include <functional>
#include <string>

// What a process tells whoever started it, in the protocol of sd_notify(3): its service manager
// ($NOTIFY_SOCKET, $WATCHDOG_USEC), and the launcher of a node that systemd starts, which hears the
// same on a socket of its own ($MIMESIS_NOTIFY_SOCKET, $MIMESIS_WATCHDOG_USEC). Nothing happens
// where these variables are not set.
namespace mimesis::runtime {

/// The node is ready.
void notify_ready();

/// What it does, in one line; `text` is called only if somebody listens.
void notify_status(const std::function<std::string()>& text);

/// It has begun to stop.
void notify_stopping();

/// The process lives. To be called at least as often as `alive_period` says; sends no oftener.
void notify_alive();

/// A quarter of the shorter watchdog time; an hour if nobody watches.
std::chrono::nanoseconds alive_period();

/// SIGINT and SIGTERM as a readable file descriptor. A second signal ends the process at once. One
/// per process.
class StopSignal {
 public:
  /// @param grace  time between the first signal and the descriptor
  explicit StopSignal(std::chrono::milliseconds grace = {});
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  int fd() const;          ///< readable `grace` after the first signal
  bool requested() const;  ///< there was a signal
};

}  // namespace mimesis::runtime
