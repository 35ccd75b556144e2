#pragma once

namespace mimesis::runtime {

/// SIGINT and SIGTERM as a readable file descriptor. A second signal ends the process at once. One
/// per process.
class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  int fd() const;  ///< readable from the first signal on
  bool requested() const;
};

/// Tells systemd (or the launcher) through $NOTIFY_SOCKET that the node is ready; nothing without
/// it.
void notify_ready();

}  // namespace mimesis::runtime
