#include "tools/mimesis/launch/watchdog.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "common/time.h"

namespace mimesis::launch {

Watchdog::Watchdog(const std::string& directory)
    : path_(fmt::format("{}/launcher-{}.notify", directory, getpid())),
      socket_(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  const int on = 1;
  const bool fits = path_.size() < sizeof address.sun_path;
  if (fits) path_.copy(address.sun_path, path_.size());
  unlink(path_.c_str());  // of a process that had this number before
  if (!fits || bind(socket_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 ||
      setsockopt(socket_.get(), SOL_SOCKET, SO_PASSCRED, &on, sizeof on) != 0) {
    throw std::runtime_error(fmt::format("no socket for the nodes' signs of life: {}: {}", path_,
                                         std::strerror(fits ? errno : ENAMETOOLONG)));
  }
}

std::vector<std::pair<std::string, std::string>> Watchdog::environment(
    const std::string& prefix) const {
  const std::chrono::microseconds period = kNamed;
  return {{prefix + "NOTIFY_SOCKET", path_},
          {prefix + "WATCHDOG_USEC", std::to_string(period.count())}};
}

std::optional<Watchdog::Sign> Watchdog::next() {
  constexpr int kOtherWords = 100;  // one after the other: then another turn
  for (int words = 0; words < kOtherWords; ++words) {
    std::array<char, 64> word{};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(ucred))> control{};
    iovec part{word.data(), word.size()};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t n = recvmsg(socket_.get(), &message, MSG_CMSG_CLOEXEC);
    if (n < 0) return std::nullopt;
    const std::string_view said(word.data(), static_cast<std::size_t>(n));
    if (said != "WATCHDOG=1" && said != "READY=1") continue;
    for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
      if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_CREDENTIALS) continue;
      ucred sender{};
      std::memcpy(&sender, CMSG_DATA(c), sizeof sender);
      return Sign{.pid = sender.pid, .ready = said == "READY=1"};
    }
  }
  return std::nullopt;
}

std::string Activity::text() const {
  switch (state) {
    case 'R':
      return "it computes";
    case 'D':
      return "it waits for a device";
    case 'T':
      return "stopped by a signal";
    case 't':
      return "stopped by a debugger";
    default:
      return "it waits";
  }
}

Activity activity(pid_t pid) {
  std::ifstream stat("/proc/" + std::to_string(pid) + "/stat");
  std::string text;
  std::getline(stat, text);
  const std::size_t bracket = text.rfind(')');  // ends the name, which may hold anything
  if (bracket == std::string::npos) return {};
  std::istringstream fields(text.substr(bracket + 1));
  Activity found;
  fields >> found.state;
  std::int64_t ticks = 0, user = 0, system = 0;
  for (int field = 4; field < 14; ++field) fields >> ticks;
  if (!(fields >> user >> system)) return {};
  found.cpu = std::chrono::nanoseconds((user + system) * (1'000'000'000 / sysconf(_SC_CLK_TCK)));
  std::ifstream schedule("/proc/" + std::to_string(pid) + "/schedstat");
  std::int64_t computed = 0, queued = 0;
  if (schedule >> computed >> queued) found.queued = std::chrono::nanoseconds(queued);
  return found;
}

std::chrono::nanoseconds silence(std::chrono::nanoseconds passed, const Activity& before,
                                 const Activity& now, std::chrono::nanoseconds& ahead) {
  if (before.state == '?') return passed;
  auto silent = passed;
  if (before.state == 'R' && now.state == 'R') {
    silent = std::min(passed, now.cpu - before.cpu);
    ahead += passed - silent;
  }
  const auto ended = now.queued - before.queued, left_out = std::min(ahead, ended);
  ahead -= left_out;
  return silent - (ended - left_out);
}

std::optional<std::chrono::nanoseconds> Silence::heard(std::chrono::nanoseconds passed) {
  const auto before = std::exchange(length_, -passed);
  does_ = {};
  ahead_ = {};
  return std::exchange(named_, false) ? before : std::nullopt;
}

bool Silence::look(pid_t pid, std::chrono::nanoseconds passed) {
  if (!length_) return false;
  if (*length_ + passed < Watchdog::kNamed / 2) {  // of many nodes that live, /proc is much to read
    *length_ += passed;
    return false;
  }
  const Activity now = activity(pid);
  *length_ += silence(passed, std::exchange(does_, now), now, ahead_);
  return !named_ && reached(Watchdog::kNamed) && (named_ = true);
}

std::string Silence::text() const {
  return fmt::format("{:.1f} s ({})", to_seconds(length_.value_or(std::chrono::nanoseconds(0))),
                     does_.text());
}

}  // namespace mimesis::launch
