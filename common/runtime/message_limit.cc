#include "common/runtime/message_limit.h"

#include <pthread.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <string_view>
#include <unordered_map>

namespace mimesis::runtime {
namespace {

std::atomic<std::uint64_t> cut_count{0}, cut_pid{0};

/// What came by one connection, as far as its limits need it.
class ZmtpStream {
 public:
  /// False: it exceeds a limit, or is not ZMTP 3, which every node speaks.
  bool take(std::string_view bytes) {
    while (!bytes.empty()) {
      const std::uint64_t part = std::min<std::uint64_t>(body_, bytes.size());
      body_ -= part;
      bytes.remove_prefix(part);
      if (bytes.empty()) break;
      const auto byte = static_cast<unsigned char>(bytes.front());
      if (seen_ < kGreeting ? !greet(byte) : header(byte) && !frame()) return false;
      bytes.remove_prefix(1);
    }
    return true;
  }

 private:
  static constexpr int kGreeting = 64, kVersion = 10, kMechanism = 12;
  static constexpr unsigned kMore = 1, kLong = 2, kCommand = 4;
  static constexpr std::uint64_t kKept = 64;  // libzmq keeps of a frame, sizeof(zmq_msg_t)

  bool greet(unsigned char byte) {
    const int at = seen_++;
    if (at == kMechanism) handshake_ = byte == 'C' ? 2 : 1;  // CURVE has two commands of a peer
    return (at != 0 || byte == 0xff) && (at != kVersion - 1 || (byte & 1U) != 0) &&
           (at != kVersion || byte >= 3);
  }
  /// True behind a frame's header.
  bool header(unsigned char byte) {
    if (size_bytes_ == 0) {
      flags_ = byte;
      size_bytes_ = (byte & kLong) != 0 ? 8 : 1;
      size_ = 0;
      return false;
    }
    size_ = size_ << 8U | byte;
    return --size_bytes_ == 0;
  }
  bool frame() {
    body_ = size_;
    const bool command = (flags_ & kCommand) != 0;
    if ((command || handshake_ > 0) && size_ > kLargestCommand) return false;
    handshake_ = std::max(handshake_ - 1, 0);
    if (command) return true;  // may stand between the frames of a message
    if (size_ > kLargestMessage || (message_ += size_ + kKept) > kLargestWhole) return false;
    if ((flags_ & kMore) == 0) message_ = 0;
    return true;
  }

  int seen_ = 0;        ///< bytes of the greeting
  int handshake_ = 0;   ///< commands that are left of it
  int size_bytes_ = 0;  ///< of the header, that are left
  unsigned flags_ = 0;
  std::uint64_t size_ = 0, body_ = 0, message_ = 0;  ///< of the frame, of its rest, so far
};

/// Connections of one of libzmq's threads, which alone reads from them.
class Connections {
 public:
  /// False: the connection is to be closed. `asked`: size of libzmq's buffer
  bool take(int fd, std::string_view bytes, std::size_t asked) {
    auto& [inode, stream] = by_fd_[fd];
    struct stat st {};
    // Less is asked for within the greeting: a connection may have the number of one that ended.
    if (asked < kBatch && fstat(fd, &st) == 0 && inode != st.st_ino) {
      inode = st.st_ino;
      stream = {};
    }
    if (stream.take(bytes)) return true;
    ucred peer{};
    socklen_t size = sizeof peer;
    getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size);  // of tcp it says nothing
    cut_pid = static_cast<std::uint64_t>(std::max(peer.pid, 0));
    ++cut_count;
    return false;
  }

 private:
  static constexpr std::size_t kBatch = 8192;  // of libzmq
  std::unordered_map<int, std::pair<ino_t, ZmtpStream>> by_fd_;
};

bool is_thread_of_libzmq() {
  std::array<char, 16> name{};
  return pthread_getname_np(pthread_self(), name.data(), name.size()) == 0 &&
         std::string_view(name.data()).starts_with("ZMQbg/IO");
}

}  // namespace

Cut cut_connections() { return {cut_count, static_cast<int>(cut_pid)}; }

}  // namespace mimesis::runtime

extern "C" __attribute__((visibility("default"))) ssize_t recv(int fd, void* buffer, size_t size,
                                                               int flags) {
  using namespace mimesis::runtime;
  const ssize_t got = recvfrom(fd, buffer, size, flags, nullptr, nullptr);
  static thread_local const bool of_libzmq = is_thread_of_libzmq();
  if (got <= 0 || !of_libzmq) return got;
  static thread_local Connections connections;
  const std::string_view bytes(static_cast<const char*>(buffer), static_cast<std::size_t>(got));
  return connections.take(fd, bytes, size) ? got : 0;  // 0: as if the peer had closed it
}
