#pragma once
#include <sys/socket.h>

#include <array>
#include <cstddef>

namespace mimesis::hw::can {

/// Messages that go to a socket, or come from it, with one system call.
class Messages {
 public:
  static constexpr std::size_t kMost = 64;

  /// Forgets the messages of the last call.
  void clear() { count_ = 0; }
  /// Data to send, or room for what comes; both outlive the call. Precondition: fewer than kMost.
  /// @param peer address to send to, or room for the sender's
  msghdr& add(const void* data, std::size_t bytes, sockaddr* peer = nullptr,
              socklen_t peer_bytes = 0) {
    parts_[count_] = {const_cast<void*>(data), bytes};
    messages_[count_] = {};
    msghdr& header = messages_[count_].msg_hdr;
    header.msg_name = peer;
    header.msg_namelen = peer_bytes;
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

}  // namespace mimesis::hw::can
