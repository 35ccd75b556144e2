#include "tools/mimesis/log/snapshot_signal.h"

namespace mimesis::tool {
namespace {

volatile std::sig_atomic_t wanted = 0;
void receive(int /*signal*/) { wanted = 1; }

}  // namespace

SnapshotSignal::SnapshotSignal() {
  wanted = 0;
  struct sigaction action {};
  action.sa_handler = receive;  // without SA_RESTART: sleeping calls return
  sigemptyset(&action.sa_mask);
  sigaction(SIGUSR1, &action, &previous_);
}

SnapshotSignal::~SnapshotSignal() { sigaction(SIGUSR1, &previous_, nullptr); }

bool SnapshotSignal::take() {
  if (wanted == 0) return false;
  wanted = 0;
  return true;
}

}  // namespace mimesis::tool
