#pragma once
#include <csignal>

namespace mimesis::tool {

/// While one lives, SIGUSR1 asks for a snapshot instead of killing.
class SnapshotSignal {
 public:
  SnapshotSignal();
  ~SnapshotSignal();
  SnapshotSignal(const SnapshotSignal&) = delete;
  SnapshotSignal& operator=(const SnapshotSignal&) = delete;
  bool take();  ///< one has come since the last call

 private:
  struct sigaction previous_ {};
};

}  // namespace mimesis::tool
