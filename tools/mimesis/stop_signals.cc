#include "tools/mimesis/stop_signals.h"

namespace mimesis::tool {
namespace {

constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP};
volatile std::sig_atomic_t received = 0;

void receive(int signal) {
  if (received == 0) received = signal;
}

}  // namespace

StopSignals::StopSignals() {
  received = 0;
  struct sigaction action {};
  action.sa_handler = receive;  // without SA_RESTART: sleeping calls return
  sigemptyset(&action.sa_mask);
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &action, &previous_[i]);
}

StopSignals::~StopSignals() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &previous_[i], nullptr);
}

bool StopSignals::requested() const { return received != 0; }
int StopSignals::signal() const { return received; }

}  // namespace mimesis::tool
