#include "hw/can/bus.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
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
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <utility>
#include <vector>

#include "common/error.h"
#include "common/runtime/log.h"
#include "common/runtime/registry.h"

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

constexpr std::size_t kLongestLine = 64;

/// A number of exactly `digits` hexadecimal (or decimal) digits at the front, which are taken off.
std::optional<std::uint32_t> take_number(std::string_view& text, std::size_t digits,
                                         std::uint32_t base = 16) {
  if (text.size() < digits) return std::nullopt;
  std::uint32_t value = 0;
  for (const char c : text.substr(0, digits)) {
    const int digit = c >= '0' && c <= '9'   ? c - '0'
                      : c >= 'A' && c <= 'F' ? c - 'A' + 10
                      : c >= 'a' && c <= 'f' ? c - 'a' + 10
                                             : 99;
    if (digit >= static_cast<int>(base)) return std::nullopt;
    value = value * base + static_cast<std::uint32_t>(digit);
  }
  text.remove_prefix(digits);
  return value;
}

/// sXRRRTTT: state and counters of receive and transmit errors.
std::optional<Frame> state_frame(std::string_view line) {
  if (line.empty()) return std::nullopt;
  const char state = line.front();
  line.remove_prefix(1);
  const auto received = take_number(line, 3, 10), sent = take_number(line, 3, 10);
  if (!received || !sent) return std::nullopt;
  Frame frame{.id = kErrorFlag, .length = 8};
  frame.data[6] = static_cast<std::uint8_t>(std::min(*sent, 255u));
  frame.data[7] = static_cast<std::uint8_t>(std::min(*received, 255u));
  frame.id |= state == 'b' ? kBusOff : kControllerState;
  switch (state) {
    case 'a':
      frame.data[1] = CAN_ERR_CRTL_ACTIVE;
      return frame;
    case 'w':
      frame.data[1] = CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING;
      return frame;
    case 'p':
      frame.data[1] = kPassive;
      return frame;
    case 'b':
      return frame;
    default:
      return std::nullopt;
  }
}

/// eNX..: N errors on the bus.
std::optional<Frame> bus_errors_frame(std::string_view line) {
  const auto count = take_number(line, 1);
  if (!count || line.size() < *count) return std::nullopt;
  Frame frame{.id = kErrorFlag, .length = 8};
  for (const char c : line.substr(0, *count)) {
    const auto broken = [&](std::uint8_t how, std::uint8_t where) {
      frame.id |= CAN_ERR_PROT | CAN_ERR_BUSERROR;
      frame.data[2] |= how;
      frame.data[3] = where;
    };
    if (c == 'a') frame.id |= CAN_ERR_BUSERROR | CAN_ERR_ACK;
    if (c == 'b') broken(CAN_ERR_PROT_BIT0, 0);
    if (c == 'B') broken(CAN_ERR_PROT_BIT1, 0);
    if (c == 'c') broken(0, CAN_ERR_PROT_LOC_CRC_SEQ);
    if (c == 'f') broken(CAN_ERR_PROT_FORM, 0);
    if (c == 's') broken(CAN_ERR_PROT_STUFF, 0);
    if (c == 'o' || c == 'O') {
      frame.id |= kControllerState;
      frame.data[1] |= c == 'o' ? CAN_ERR_CRTL_RX_OVERFLOW : CAN_ERR_CRTL_TX_OVERFLOW;
    }
  }
  return frame;
}

class SlcanBus final : public Bus {
 public:
  explicit SlcanBus(const std::string& device) {
    const std::size_t at = device.find('@');
    const std::string path = device.substr(0, at);
    const std::string bitrate = at == std::string::npos ? "1000000" : device.substr(at + 1);
    const auto refuse = [&](const std::string& why) {
      if (line_ >= 0) close(line_);
      throw ConfigError("CAN adapter '" + device + "': " + why);
    };
    constexpr std::array kBitrates{"10000",  "20000",  "50000",  "100000", "125000",
                                   "250000", "500000", "800000", "1000000"};
    const auto* rate = std::ranges::find(kBitrates, bitrate);
    if (rate == kBitrates.end()) {
      refuse(fmt::format("bit rate '{}', expected one of {}", bitrate, fmt::join(kBitrates, ", ")));
    }
    line_ = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    termios settings{};
    if (line_ < 0 || ioctl(line_, TIOCEXCL) < 0 || tcgetattr(line_, &settings) < 0)
      refuse(std::strerror(errno));
    cfmakeraw(&settings);
    settings.c_cflag |= CLOCAL | CREAD;
    cfsetspeed(&settings, B115200);  // USB does not care
    const bool set = tcsetattr(line_, TCSANOW, &settings) == 0 && tcflush(line_, TCIOFLUSH) == 0;
    if (!set) refuse(std::strerror(errno));
    const std::string open = fmt::format("C\rS{}\rO\r", rate - kBitrates.begin());
    if (write(line_, open.data(), open.size()) != std::ssize(open))
      refuse("does not take commands");
  }
  ~SlcanBus() override {
    if (write(line_, "C\r", 2) < 0) ++counters_.errors;  // the adapter is gone
    close(line_);
  }
  SlcanBus(const SlcanBus&) = delete;
  SlcanBus& operator=(const SlcanBus&) = delete;

  /// A line that the port has taken a part of is completed first; frames that do not fit are gone.
  void send(std::span<const Frame> frames) override {
    begun_.erase(0, put(begun_));
    lines_.clear();
    ends_.clear();
    for (const Frame& frame : frames) {
      if (begun_.empty() && to_line(frame, lines_)) ends_.push_back(lines_.size());
    }
    const std::size_t written = put(lines_);
    std::size_t sent = 0;
    while (sent < ends_.size() && ends_[sent] <= written) ++sent;
    const std::size_t whole = sent == 0 ? 0 : ends_[sent - 1];
    if (written > whole) begun_ = lines_.substr(written, ends_[sent++] - written);
    counters_.sent += sent;
    counters_.errors += frames.size() - sent;
  }

  std::size_t receive(std::span<Frame> frames) override {
    std::size_t filled = 0;
    while (filled < frames.size()) {
      if (next_ == got_) {
        const ssize_t bytes = read(line_, arrived_.data(), arrived_.size());
        if (bytes <= 0) break;
        got_ = static_cast<std::size_t>(bytes);
        next_ = 0;
      }
      const char c = arrived_[next_++];
      const bool complains = c == '\a';
      if (complains) ++counters_.errors;
      if (c != '\r' && !complains) {
        if (heard_.size() < kLongestLine) heard_.push_back(c);
        continue;
      }
      if (const auto frame = from_line(heard_)) {
        ++((frame->id & kErrorFlag) != 0 ? counters_.errors : counters_.received);
        frames[filled++] = *frame;
      }
      heard_.clear();
    }
    return filled;
  }

 private:
  std::size_t put(const std::string& bytes) const {
    const ssize_t written = bytes.empty() ? 0 : write(line_, bytes.data(), bytes.size());
    return written < 0 ? 0 : static_cast<std::size_t>(written);
  }

  int line_ = -1;
  std::string lines_, begun_, heard_;
  std::vector<std::size_t> ends_;
  std::array<char, 1024> arrived_{};
  std::size_t got_ = 0, next_ = 0;
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

bool to_line(const Frame& frame, std::string& out) {
  const bool fd = frame.length > 8 || (frame.flags & kFd) != 0;
  if (fd || (frame.id & kErrorFlag) != 0) return false;
  const bool wide = (frame.id & kExtendedFlag) != 0, remote = (frame.id & kRemoteFlag) != 0;
  const char kind = remote ? (wide ? 'R' : 'r') : (wide ? 'T' : 't');
  const std::uint32_t id = frame.id & (wide ? 0x1FFFFFFFu : 0x7FFu);
  fmt::format_to(std::back_inserter(out), "{}{:0{}X}{}", kind, id, wide ? 8 : 3, frame.length);
  for (std::size_t i = 0; !remote && i < frame.length; ++i)
    fmt::format_to(std::back_inserter(out), "{:02X}", frame.data[i]);
  out.push_back('\r');
  return true;
}

std::optional<Frame> from_line(std::string_view line) {
  if (line.empty()) return std::nullopt;
  const char kind = line.front();
  line.remove_prefix(1);
  if (kind == 's') return state_frame(line);
  if (kind == 'e') return bus_errors_frame(line);
  const bool wide = kind == 'T' || kind == 'R', remote = kind == 'r' || kind == 'R';
  if (!wide && !remote && kind != 't') return std::nullopt;
  const auto id = take_number(line, wide ? 8 : 3), length = take_number(line, 1);
  if (!id || !length || *id > (wide ? 0x1FFFFFFFu : 0x7FFu) || *length > 8) return std::nullopt;
  Frame frame{.id = *id | (wide ? kExtendedFlag : 0) | (remote ? kRemoteFlag : 0),
              .length = static_cast<std::uint8_t>(*length)};
  for (std::size_t i = 0; !remote && i < *length; ++i) {
    const auto byte = take_number(line, 2);
    if (!byte) return std::nullopt;
    frame.data[i] = static_cast<std::uint8_t>(*byte);
  }
  const bool stamped = line.size() == 4;  // milliseconds, of adapters that are told to
  return line.empty() || stamped ? std::optional(frame) : std::nullopt;
}

std::unique_ptr<Bus> open_slcan(const std::string& device) {
  return std::make_unique<SlcanBus>(device);
}

}  // namespace mimesis::hw::can
