#include "common/runtime/service_manager.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string_view>

namespace mimesis::runtime {
namespace {

using Clock = std::chrono::steady_clock;

/// The manager's socket, once per process.
class Manager {
 public:
  Manager() {
    const char* path = std::getenv("NOTIFY_SOCKET");
    if (path == nullptr || (*path != '/' && *path != '@')) return;
    const std::string_view name(path);
    if (name.size() >= sizeof address_.sun_path) return;
    address_.sun_family = AF_UNIX;
    std::memcpy(address_.sun_path, name.data(), name.size());
    if (*path == '@') address_.sun_path[0] = '\0';  // abstract namespace
    size_ = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
    socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const char* usec = std::getenv("WATCHDOG_USEC");
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

 private:
  int socket_ = -1;
  sockaddr_un address_{};
  socklen_t size_ = 0;
  std::chrono::nanoseconds period_ = std::chrono::hours(1);
  Clock::time_point told_{};
};

Manager& manager() {
  static Manager one;
  return one;
}

}  // namespace

void notify_ready() { manager().tell("READY=1"); }
void notify_alive() { manager().tell_alive(); }
std::chrono::nanoseconds alive_period() { return manager().period(); }

}  // namespace mimesis::runtime
