#include "common/runtime/stop_signal.h"

#include <sys/timerfd.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>

#include "common/error.h"

namespace mimesis::runtime {
namespace {

int signal_fd = -1;
itimerspec stop_after{};
volatile std::sig_atomic_t signalled = 0;

void on_signal(int) {
  signalled = 1;
  timerfd_settime(signal_fd, 0, &stop_after, nullptr);
}

}  // namespace

StopSignal::StopSignal(std::chrono::milliseconds grace) {
  MIMESIS_ASSERT(signal_fd < 0);
  signal_fd = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
  MIMESIS_ASSERT(signal_fd >= 0);
  signalled = 0;
  const auto whole = std::chrono::floor<std::chrono::seconds>(grace);
  stop_after.it_value.tv_sec = whole.count();
  stop_after.it_value.tv_nsec = std::chrono::nanoseconds(grace - whole).count() + 1;  // 0 disarms
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGPIPE,
              SIG_IGN);  // an orphan whose standard error is gone still stops its actuators
}

StopSignal::~StopSignal() {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  close(signal_fd);
  signal_fd = -1;
}

int StopSignal::fd() const { return signal_fd; }

bool StopSignal::requested() const { return signalled != 0; }

}  // namespace mimesis::runtime
