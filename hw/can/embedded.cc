#include "hw/can/embedded.h"

#include <sys/inotify.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "common/error.h"

namespace mimesis::hw::can {
namespace {

namespace fs = std::filesystem;

sockaddr_un socket_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path)) {
    throw ConfigError("CAN bus: the socket's path is longer than " +
                      std::to_string(sizeof(address.sun_path) - 1) + " bytes: " + path);
  }
  std::copy(path.begin(), path.end(), address.sun_path);
  return address;
}

[[noreturn]] void fail(const std::string& what) {
  throw ConfigError("CAN bus: " + what + ": " + std::strerror(errno));
}

}  // namespace

EmbeddedBus::EmbeddedBus(const std::string& name, const std::string& directory)
    : folder_((fs::path(directory) / ("can-" + name)).string()), arrived_(kBatch) {
  static std::atomic<int> participants{0};
  path_ = folder_ + "/" + std::to_string(getpid()) + "." + std::to_string(participants++);
  const sockaddr_un address = socket_address(path_);
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw ConfigError("CAN bus: cannot make " + folder_ + ": " + error.message());

  watch_ = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  if (watch_ < 0 || inotify_add_watch(watch_, folder_.c_str(), IN_CREATE | IN_DELETE) < 0) {
    fail("cannot watch " + folder_);
  }
  socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  unlink(path_.c_str());  // of a dead process that had our number
  if (socket_ < 0 ||
      bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) < 0) {
    fail("cannot bind " + path_);
  }
  find_peers();
}

EmbeddedBus::~EmbeddedBus() {
  unlink(path_.c_str());
  if (socket_ >= 0) close(socket_);
  if (watch_ >= 0) close(watch_);
}

void EmbeddedBus::find_peers() {
  peers_.clear();
  std::error_code error;
  std::vector<std::string> paths;
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    if (entry.path() != path_) paths.push_back(entry.path().string());
  }
  std::sort(paths.begin(), paths.end());  // one order of delivery, whatever the file system says
  for (const std::string& path : paths) peers_.push_back(socket_address(path));
}

void EmbeddedBus::forget_dead(std::size_t peer) {
  unlink(peers_[peer].sun_path);
  peers_.erase(peers_.begin() + static_cast<std::ptrdiff_t>(peer));
}

bool EmbeddedBus::send_to_all(std::span<const Frame> batch) {
  bool taken = !peers_.empty();  // a frame that nobody acknowledges is not sent: as on a wire
  for (std::size_t i = 0; i < peers_.size();) {
    const auto* to = reinterpret_cast<const sockaddr*>(&peers_[i]);
    if (sendto(socket_, batch.data(), batch.size_bytes(), MSG_NOSIGNAL, to, sizeof(sockaddr_un)) >=
        0) {
      ++i;
    } else if (errno == ECONNREFUSED || errno == ENOENT) {
      forget_dead(i);
      taken = taken && !peers_.empty();
    } else {
      taken = false;  // its queue is full
      ++i;
    }
  }
  return taken;
}

void EmbeddedBus::send(std::span<const Frame> frames) {
  alignas(inotify_event) char events[1024];
  bool changed = false;
  while (read(watch_, events, sizeof(events)) > 0) changed = true;
  if (changed) find_peers();
  while (!frames.empty()) {
    const auto batch = frames.first(std::min(frames.size(), kBatch));
    (send_to_all(batch) ? counters_.sent : counters_.errors) += batch.size();
    frames = frames.subspan(batch.size());
  }
}

std::size_t EmbeddedBus::receive(std::span<Frame> frames) {
  std::size_t filled = 0;
  while (filled < frames.size()) {
    if (next_ == count_) {
      const ssize_t bytes = recv(socket_, arrived_.data(), kBatch * sizeof(Frame), MSG_TRUNC);
      if (bytes < 0) break;
      const std::size_t whole = static_cast<std::size_t>(bytes) / sizeof(Frame);
      const bool sound = whole <= kBatch && static_cast<std::size_t>(bytes) % sizeof(Frame) == 0;
      if (!sound) ++counters_.errors;  // not one of ours
      count_ = sound ? whole : 0;
      next_ = 0;
      continue;
    }
    const Frame& frame = arrived_[next_++];
    if (frame.length > frame.data.size()) {
      ++counters_.errors;
      continue;
    }
    ++((frame.id & kErrorFlag) != 0 ? counters_.errors : counters_.received);
    frames[filled++] = frame;
  }
  return filled;
}

}  // namespace mimesis::hw::can
