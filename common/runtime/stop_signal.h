#pragma once
#include <chrono>

namespace mimesis::runtime {

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
