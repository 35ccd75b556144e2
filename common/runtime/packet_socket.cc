#include "common/runtime/packet_socket.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "common/error.h"

namespace mimesis::runtime {
namespace {

constexpr int kBacklog = 64;

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    throw ConfigError("socket path " + path +
                      " is longer than the 107 bytes that a Unix socket allows");
  }
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

}  // namespace

PacketSocket::~PacketSocket() {
  if (fd_ >= 0) close(fd_);
}
PacketSocket& PacketSocket::operator=(PacketSocket&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

PacketSocket PacketSocket::listen(const std::string& path) {
  const sockaddr_un address = address_of(path);
  PacketSocket s(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  unlink(path.c_str());
  if (!s.valid() || bind(s.fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(s.fd_, kBacklog) != 0) {
    throw ConfigError("cannot listen on " + path + ": " + std::strerror(errno));
  }
  return s;
}

PacketSocket PacketSocket::connect(const std::string& path) {
  const sockaddr_un address = address_of(path);
  PacketSocket s(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  if (!s.valid() ||
      ::connect(s.fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    return {};
  return s;
}

PacketSocket PacketSocket::accept() const {
  return PacketSocket(accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC));
}

bool PacketSocket::send(std::string_view packet) const {
  ssize_t sent = 0;
  do {
    sent = ::send(fd_, packet.data(), packet.size(), MSG_NOSIGNAL);
  } while (sent < 0 && errno == EINTR);
  return sent == static_cast<ssize_t>(packet.size());
}

PacketSocket::Result PacketSocket::receive(std::string& packet) const {
  // The length first: packets are not limited by a buffer of ours.
  ssize_t size = 0;
  do {
    size = recv(fd_, nullptr, 0, MSG_PEEK | MSG_TRUNC | MSG_DONTWAIT);
  } while (size < 0 && errno == EINTR);
  if (size < 0) {
    return errno == EAGAIN || errno == EWOULDBLOCK ? Result::nothing : Result::closed;
  }
  if (size == 0) return Result::closed;  // packets of ours are never empty
  packet.resize(static_cast<std::size_t>(size));
  return recv(fd_, packet.data(), packet.size(), MSG_DONTWAIT) == size ? Result::packet
                                                                       : Result::closed;
}

}  // namespace mimesis::runtime
