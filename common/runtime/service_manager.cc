#include "common/runtime/service_manager.h"

#include <sys/socket.h>
#include <sys/timerfd.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "common/error.h"

namespace mimesis::runtime {
namespace {

using Clock = std::chrono::steady_clock;

/// The socket of one listener.
class Manager {
 public:
  /// `prefix`: of the names of the variables
  explicit Manager(const std::string& prefix) {
    const char* path = std::getenv((prefix + "NOTIFY_SOCKET").c_str());
    if (path == nullptr || (*path != '/' && *path != '@')) return;
    const std::string_view name(path);
    if (name.size() >= sizeof address_.sun_path) return;
    address_.sun_family = AF_UNIX;
    std::memcpy(address_.sun_path, name.data(), name.size());
    if (*path == '@') address_.sun_path[0] = '\0';  // abstract namespace
    size_ = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
    socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const char* usec = std::getenv((prefix + "WATCHDOG_USEC").c_str());
    long long value = 0;
    if (usec == nullptr || socket_ < 0) return;
    std::from_chars(usec, usec + std::strlen(usec), value);
    if (value > 0) period_ = std::chrono::microseconds(value) / 4;
  }

  /// Best effort by the protocol's design: a manager that does not listen is not our failure.
  void tell(std::string_view word) const {
    if (socket_ < 0) return;
    [[maybe_unused]] const auto sent = sendto(socket_, word.data(), word.size(), MSG_NOSIGNAL,
                                              reinterpret_cast<const sockaddr*>(&address_), size_);
  }
  void tell_alive() {
    const auto now = Clock::now();
    if (now - told_ < period_) return;
    told_ = now;
    tell("WATCHDOG=1");
  }
  std::chrono::nanoseconds period() const { return period_; }
  bool listens() const { return socket_ >= 0; }

 private:
  int socket_ = -1;
  sockaddr_un address_{};
  socklen_t size_ = 0;
  std::chrono::nanoseconds period_ = std::chrono::hours(1);
  Clock::time_point told_{};
};

/// Once per process.
std::array<Manager, 2>& managers() {
  static std::array<Manager, 2> both{Manager(""), Manager("MIMESIS_")};
  return both;
}

void tell_all(std::string_view word) {
  for (const Manager& manager : managers()) manager.tell(word);
}

}  // namespace

void notify_ready() { tell_all("READY=1"); }
void notify_status(const std::function<std::string()>& text) {
  if (std::ranges::any_of(managers(), &Manager::listens)) tell_all("STATUS=" + text());
}
void notify_stopping() { tell_all("STOPPING=1"); }
void notify_alive() {
  for (Manager& manager : managers()) manager.tell_alive();
}
std::chrono::nanoseconds alive_period() {
  return std::min(managers()[0].period(), managers()[1].period());
}

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
