#include "common/runtime/stopped_subscribers.h"

#include <fmt/format.h>
#include <sys/socket.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <string>

#include "common/runtime/log.h"

namespace mimesis::runtime {
namespace {

using namespace std::chrono_literals;

int pid_of_peer(int fd) {
  ucred peer{};
  socklen_t size = sizeof peer;
  return getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 ? peer.pid : 0;
}

/// Its name if a signal has stopped it, else empty.
std::string name_if_stopped(int pid) {
  std::ifstream file(fmt::format("/proc/{}/stat", pid));
  std::string stat;
  std::getline(file, stat);  // "PID (NAME) STATE ..."
  const std::size_t open = stat.find('('), close = stat.rfind(") ");
  if (open == std::string::npos || close == std::string::npos) return "";
  return stat.compare(close + 2, 2, "T ") == 0 ? stat.substr(open + 1, close - open - 1) : "";
}

}  // namespace

void StoppedSubscribers::note(const Frame& subscription) {
  if (const int pid = subscription.peer_pid(); pid > 0) {
    by_fd_.insert_or_assign(subscription.connection(), Peer{.pid = pid});
  }
}

void StoppedSubscribers::look(Clock::time_point now) {
  constexpr auto kBetween = 500ms, kEnds = 3000ms;
  if (now - looked_ < kBetween) return;
  // This process may have been stopped itself, and peers go on a moment after it.
  const auto passed = std::min<Clock::duration>(now - looked_, 2 * kBetween);
  looked_ = now;
  for (auto it = by_fd_.begin(); it != by_fd_.end();) {
    auto& [fd, peer] = *it;
    bool ends = pid_of_peer(fd) != peer.pid;  // it is another's by now
    if (!ends) {
      const std::string name = name_if_stopped(peer.pid);
      peer.stopped = name.empty() ? Clock::duration() : peer.stopped + passed;
      if ((ends = peer.stopped >= kEnds)) {
        warn(
            "process {} ({}), stopped by a signal, holds up others: it is cut off and misses "
            "messages",
            peer.pid, printable(name));
        shutdown(fd, SHUT_RDWR);
      }
    }
    it = ends ? by_fd_.erase(it) : std::next(it);
  }
}

}  // namespace mimesis::runtime
