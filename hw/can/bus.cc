#include "hw/can/bus.h"

#include <dirent.h>
#include <fcntl.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/errqueue.h>
#include <linux/net_tstamp.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

#include "common/error.h"
#include "common/runtime/log.h"
#include "common/runtime/registry.h"
#include "hw/can/slcan.h"

namespace mimesis::hw::can {
namespace {

namespace fs = std::filesystem;

/// Messages that go to a socket, or come from it, with one system call.
class Messages {
 public:
  static constexpr std::size_t kMost = 64;

  /// Forgets the messages of the last call.
  void clear() { count_ = 0; }
  /// Data to send, or room for what comes; both outlive the call. Precondition: fewer than kMost.
  msghdr& add(const void* data, std::size_t bytes) {
    parts_[count_] = {const_cast<void*>(data), bytes};
    messages_[count_] = {};
    msghdr& header = messages_[count_].msg_hdr;
    header.msg_iov = &parts_[count_++];
    header.msg_iovlen = 1;
    return header;
  }
  /// Never blocks. @return how many were taken, in their order
  std::size_t send(int socket) {
    const int taken = sendmmsg(socket, messages_.data(), static_cast<unsigned>(count_), 0);
    return taken < 0 ? 0 : static_cast<std::size_t>(taken);
  }
  /// Never blocks. @return how many have come
  std::size_t receive(int socket) {
    const int got =
        recvmmsg(socket, messages_.data(), static_cast<unsigned>(count_), MSG_DONTWAIT, nullptr);
    return got < 0 ? 0 : static_cast<std::size_t>(got);
  }
  const msghdr& header(std::size_t i) const { return messages_[i].msg_hdr; }
  std::size_t bytes(std::size_t i) const { return messages_[i].msg_len; }  ///< that have come

 private:
  std::array<iovec, kMost> parts_;
  std::array<mmsghdr, kMost> messages_;
  std::size_t count_ = 0;
};

constexpr std::size_t kLongestPath = sizeof(sockaddr_un::sun_path) - 1;

sockaddr_un socket_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() > kLongestPath) {
    throw ConfigError("CAN bus: the socket's path is longer than " + std::to_string(kLongestPath) +
                      " bytes: " + path);
  }
  std::copy(path.begin(), path.end(), address.sun_path);
  return address;
}

[[noreturn]] void fail(const std::string& what) {
  throw ConfigError("CAN bus: " + what + ": " + std::strerror(errno));
}

/// A CAN bus without CAN: every participant is a Unix datagram socket in DIRECTORY/can-NAME, every
/// frame goes to all other sockets there. A batch travels as one datagram of canfd_frames back to
/// back: a socket holds only net.unix.max_dgram_qlen + 1 = 11 datagrams, fewer than the frames of
/// one cycle of eight axes, and a batch arrives whole. Sockets of the dead are found by the refused
/// connection and removed.
class EmbeddedBus final : public Bus {
 public:
  /// @throws ConfigError if the folder or the socket cannot be made
  EmbeddedBus(const std::string& name, const std::string& directory)
      : folder_((fs::path(directory) / ("can-" + name)).string()), arrived_(kBatch) {
    static std::atomic<int> participants{0};
    peers_.reserve(kMostPeers);
    path_ = folder_ + "/" + std::to_string(getpid()) + "." + std::to_string(participants++);
    const sockaddr_un address = socket_address(path_);
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (socket_ < 0) fail("cannot open a socket");
    // The last of another group of participants may remove the folder at any time.
    for (int left = kTries; !enter(address); --left)
      if (left == 0) fail("cannot bind " + path_);
  }

  ~EmbeddedBus() override {
    unlink(path_.c_str());
    rmdir(folder_.c_str());  // stays while others are in it
    if (socket_ >= 0) close(socket_);
  }

  EmbeddedBus(const EmbeddedBus&) = delete;
  EmbeddedBus& operator=(const EmbeddedBus&) = delete;

  void send(std::span<const Frame> frames) override {
    if (changes_.look(folder_, std::chrono::steady_clock::now())) find_peers();
    while (!frames.empty()) {
      const auto batch = frames.first(std::min(frames.size(), kBatch));
      (send_to_all(batch) ? counters_.sent : counters_.errors) += batch.size();
      frames = frames.subspan(batch.size());
    }
  }

  std::size_t receive(std::span<Frame> frames) override {
    std::size_t filled = 0;
    while (filled < frames.size()) {
      if (next_ == count_) {
        const ssize_t bytes = recv(socket_, arrived_.data(), kBatch * sizeof(Frame), MSG_TRUNC);
        if (bytes < 0) break;
        const std::size_t whole = static_cast<std::size_t>(bytes) / sizeof(Frame);
        const bool sound = whole <= kBatch && static_cast<std::size_t>(bytes) % sizeof(Frame) == 0;
        if (!sound) ++counters_.errors;  // not a socket of this program
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

  static constexpr std::size_t kBatch = 64;      ///< most frames per datagram
  static constexpr std::size_t kMostPeers = 64;  ///< most other participants

 private:
  static constexpr int kTries = 100;

  /// Makes and joins the folder; false if somebody removed it meanwhile.
  bool enter(const sockaddr_un& address) {
    std::error_code error;
    fs::create_directories(folder_, error);
    // file_exists: it was removed between mkdir and a look at what is there.
    if (error && error != std::errc::file_exists)
      throw ConfigError("CAN bus: cannot make " + folder_ + ": " + error.message());
    unlink(path_.c_str());  // socket of a dead process that had our number
    const auto* here = reinterpret_cast<const sockaddr*>(&address);
    const bool joined = bind(socket_, here, sizeof(address)) == 0;
    if (!joined && errno != ENOENT) fail("cannot bind " + path_);
    return joined;
  }

  /// Reads the folder by hand: in a cycle nothing allocates, not even when somebody joins.
  void find_peers() {
    peers_.clear();
    const int folder = ::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder < 0) return;
    alignas(dirent64) std::array<char, 4096> entries;
    bool strange = false;
    for (ssize_t bytes = 0; (bytes = getdents64(folder, entries.data(), entries.size())) > 0;) {
      for (ssize_t at = 0; at < bytes;) {
        const auto& entry =
            *reinterpret_cast<const dirent64*>(&entries[static_cast<std::size_t>(at)]);
        at += entry.d_reclen;
        const std::string_view name(entry.d_name);
        if (name == "." || name == ".." ||
            name == std::string_view(path_).substr(folder_.size() + 1))
          continue;
        struct stat st {};
        const bool there = fstatat(folder, entry.d_name, &st, AT_SYMLINK_NOFOLLOW) == 0;
        const bool usable = S_ISSOCK(st.st_mode) &&
                            folder_.size() + 1 + name.size() <= kLongestPath &&
                            peers_.size() < kMostPeers;
        strange = strange || (there && !usable);
        if (!there || !usable) continue;
        sockaddr_un& peer = peers_.emplace_back();
        peer.sun_family = AF_UNIX;
        char* path = std::copy(folder_.begin(), folder_.end(), peer.sun_path);
        *path = '/';
        std::copy(name.begin(), name.end(), path + 1);
      }
    }
    close(folder);
    if (strange && !std::exchange(said_strange_, true)) {
      runtime::warn(
          "CAN bus: entries of {} are skipped: expected at most {} sockets with paths of {} bytes",
          folder_, kMostPeers, kLongestPath);
    }
    // One order of delivery, independent of the file system.
    std::ranges::sort(peers_, [](const sockaddr_un& a, const sockaddr_un& b) {
      return std::strcmp(a.sun_path, b.sun_path) < 0;
    });
  }

  void forget_dead(std::size_t peer) {
    unlink(peers_[peer].sun_path);
    peers_.erase(peers_.begin() + static_cast<std::ptrdiff_t>(peer));
  }

  bool send_to_all(std::span<const Frame> batch) {
    bool taken = !peers_.empty();  // a frame without an acknowledgement is not sent: as on a wire
    for (std::size_t i = 0; i < peers_.size();) {
      const auto* to = reinterpret_cast<const sockaddr*>(&peers_[i]);
      if (sendto(socket_, batch.data(), batch.size_bytes(), MSG_NOSIGNAL, to,
                 sizeof(sockaddr_un)) >= 0) {
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

  std::string folder_, path_;
  int socket_ = -1;
  runtime::FolderChanges changes_;  // participants that come and go
  std::vector<sockaddr_un> peers_;
  bool said_strange_ = false;
  std::vector<Frame> arrived_;  // last datagram, consumed from `next_`
  std::size_t count_ = 0, next_ = 0;
};

static_assert(sizeof(Frame) == sizeof(canfd_frame));

/// Arrival of a message: by the interface's clock, else by the kernel's; 0 without either.
std::chrono::nanoseconds stamp_of(const msghdr& header) {
  auto* at = const_cast<msghdr*>(&header);
  for (cmsghdr* c = CMSG_FIRSTHDR(at); c != nullptr; c = CMSG_NXTHDR(at, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPING) continue;
    scm_timestamping times{};
    std::memcpy(&times, CMSG_DATA(c), sizeof times);
    const bool by_interface = times.ts[2].tv_sec != 0;
    const timespec& time = times.ts[by_interface ? 2 : 0];
    return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
  }
  return {};
}

/// The kernel's CAN (AF_CAN, SOCK_RAW) on one interface, error frames included. One system call per
/// batch.
class SocketCan final : public Bus {
 public:
  /// @throws ConfigError if the kernel has no CAN, or the interface is missing or down
  explicit SocketCan(const std::string& interface) : stamps_(kMostStamps) {
    const std::string who = "CAN interface '" + interface + "': ";
    if (interface.size() >= IFNAMSIZ) throw ConfigError(who + "the name is too long");
    socket_ = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
    if (socket_ < 0) {
      throw ConfigError(who + "this kernel has no SocketCAN (" + std::strerror(errno) +
                        "); embedded:NAME needs none");
    }
    const auto refuse = [&](const std::string& why) {
      close(socket_);
      throw ConfigError(who + why);
    };
    ifreq request{};
    std::copy(interface.begin(), interface.end(), request.ifr_name);
    if (ioctl(socket_, SIOCGIFFLAGS, &request) < 0) refuse("no such interface");
    if ((request.ifr_flags & IFF_UP) == 0) refuse("is down: ip link set " + interface + " up");

    const can_err_mask_t all_errors = CAN_ERR_MASK;
    const int on = 1;
    const int stamping = SOF_TIMESTAMPING_RX_HARDWARE | SOF_TIMESTAMPING_RAW_HARDWARE |
                         SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE;
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
    if (setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &all_errors, sizeof(all_errors)) < 0 ||
        setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof(on)) < 0 ||
        setsockopt(socket_, SOL_SOCKET, SO_TIMESTAMPING, &stamping, sizeof(stamping)) < 0 ||
        bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) < 0) {
      refuse(std::strerror(errno));
    }
  }

  ~SocketCan() override { close(socket_); }

  SocketCan(const SocketCan&) = delete;
  SocketCan& operator=(const SocketCan&) = delete;

  void send(std::span<const Frame> frames) override {
    while (!frames.empty()) {
      const auto batch = frames.first(std::min(frames.size(), Messages::kMost));
      messages_.clear();
      for (const Frame& frame : batch) {
        // A classic frame is the head of an FD frame; its size tells the kernel which one it gets.
        const bool fd = frame.length > CAN_MAX_DLEN || (frame.flags & kFd) != 0;
        messages_.add(&frame, fd ? CANFD_MTU : CAN_MTU);
      }
      const std::size_t sent = messages_.send(socket_);
      counters_.sent += sent;
      if (sent <
          batch.size()) {  // ENOBUFS, or the interface went down: the next cycle has newer frames
        counters_.errors += frames.size() - sent;
        return;
      }
      frames = frames.subspan(batch.size());
    }
  }

  std::size_t receive(std::span<Frame> frames) override {
    received_ = 0;
    while (received_ < frames.size()) {
      const std::size_t room = std::min(frames.size() - received_, Messages::kMost);
      messages_.clear();
      for (std::size_t i = 0; i < room; ++i) {
        frames[received_ + i] = Frame{};
        msghdr& header = messages_.add(&frames[received_ + i], sizeof(Frame));
        header.msg_control = control_[i].data();
        header.msg_controllen = control_[i].size();
      }
      const std::size_t got = messages_.receive(socket_);
      if (got == 0) break;
      for (std::size_t i = 0; i < got; ++i, ++received_) {
        Frame& frame = frames[received_];
        if (messages_.bytes(i) == CANFD_MTU) frame.flags |= kFd;
        if (received_ < kMostStamps) stamps_[received_] = stamp_of(messages_.header(i));
        ++((frame.id & kErrorFlag) != 0 ? counters_.errors : counters_.received);
      }
    }
    return received_;
  }

  std::span<const std::chrono::nanoseconds> stamps() const override {
    return std::span(stamps_).first(std::min(received_, kMostStamps));
  }

  void want(std::span<const Wanted> wanted) override {
    std::vector<can_filter> filters;
    for (const Wanted& w : wanted)
      filters.push_back({.can_id = w.id, .can_mask = w.mask | kExtendedFlag | kRemoteFlag});
    const auto bytes = static_cast<socklen_t>(filters.size() * sizeof(can_filter));
    if (setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), bytes) < 0)
      fail("filters");
  }

 private:
  static constexpr std::size_t kMostStamps = 256;  // of a call

  int socket_ = -1;
  Messages messages_;
  alignas(cmsghdr)
      std::array<std::array<char, CMSG_SPACE(sizeof(scm_timestamping))>, Messages::kMost> control_;
  std::vector<std::chrono::nanoseconds> stamps_;
  std::size_t received_ = 0;  // by the last call
};

}  // namespace

const char* trouble(const Frame& frame) {
  if ((frame.id & kErrorFlag) == 0) return nullptr;
  if ((frame.id & kBusOff) != 0) return "bus-off";
  const bool passive = (frame.id & kControllerState) != 0 && (frame.data[1] & kPassive) != 0;
  return passive ? "error-passive" : nullptr;
}

void check_address(const std::string& address) {
  const std::size_t colon = address.find(':');
  const std::string kind = address.substr(0, colon);
  const bool named = colon != std::string::npos && colon + 1 < address.size();
  if (named && kind == "embedded" && address.find('/') == std::string::npos) return;
  if (named && kind == "socketcan") return;
  if (named && kind == "slcan" && address[colon + 1] == '/') return;
  throw ConfigError("CAN bus '" + address +
                    "': expected embedded:NAME, socketcan:INTERFACE or slcan:/dev/NAME");
}

std::unique_ptr<Bus> open(const std::string& address, const std::string& directory) {
  check_address(address);
  const std::string name = address.substr(address.find(':') + 1);
  if (address.starts_with("embedded")) return std::make_unique<EmbeddedBus>(name, directory);
  if (address.starts_with("slcan")) return open_slcan(name);
  return std::make_unique<SocketCan>(name);
}

}  // namespace mimesis::hw::can
