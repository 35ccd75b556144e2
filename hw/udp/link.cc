#include "hw/udp/link.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <cstring>

#include "common/error.h"

namespace mimesis::hw::udp {
namespace {

constexpr std::size_t kAtOnce = 256, kLargest = 2048;

[[noreturn]] void refuse(const std::string& address, const std::string& why) {
  throw ConfigError("UDP '" + address + "': " + why);
}

sockaddr_in resolve(const std::string& address) {
  check_address(address);
  const auto colon = address.rfind(':');
  const std::string host = address.substr(0, colon), port = address.substr(colon + 1);
  addrinfo hints{};
  hints.ai_flags = AI_NUMERICSERV;
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(host.c_str(), port.c_str(), &hints, &found); error != 0)
    refuse(address, gai_strerror(error));
  sockaddr_in result{};
  std::memcpy(&result, found->ai_addr, sizeof result);
  freeaddrinfo(found);
  return result;
}

std::string text(const sockaddr_in& address) {
  std::array<char, INET_ADDRSTRLEN> host{};
  inet_ntop(AF_INET, &address.sin_addr, host.data(), host.size());
  return std::string(host.data()) + ":" + std::to_string(ntohs(address.sin_port));
}

int open_socket(const std::string& address) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) refuse(address, std::strerror(errno));
  return fd;
}

class UdpLink final : public Link {
 public:
  explicit UdpLink(const std::string& address) {
    const sockaddr_in peer = resolve(address);
    socket_ = open_socket(address);
    if (::connect(socket_, reinterpret_cast<const sockaddr*>(&peer), sizeof peer) != 0) {
      const std::string why = std::strerror(errno);
      close(socket_);
      refuse(address, why);
    }
  }
  ~UdpLink() override { close(socket_); }
  UdpLink(const UdpLink&) = delete;
  UdpLink& operator=(const UdpLink&) = delete;

  bool send(std::string_view datagram) override {
    return ::send(socket_, datagram.data(), datagram.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(datagram.size());
  }

  std::vector<std::string> receive() override {
    std::vector<std::string> all;
    std::array<char, kLargest> buffer;
    for (std::size_t i = 0; i < kAtOnce; ++i) {
      const ssize_t size = recv(socket_, buffer.data(), buffer.size(), MSG_TRUNC);
      if (size < 0 && errno == ECONNREFUSED) continue;  // of an earlier datagram
      if (size < 0) break;
      all.emplace_back(buffer.data(), std::min(static_cast<std::size_t>(size), buffer.size()));
    }
    return all;
  }

 private:
  int socket_ = -1;
};

}  // namespace

void check_address(const std::string& address) {
  const auto colon = address.rfind(':');
  const std::string_view port =
      colon == std::string::npos ? "" : std::string_view(address).substr(colon + 1);
  int number = 0;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
  const bool whole = error == std::errc() && end == port.data() + port.size();
  if (!whole || colon == 0 || number < 1 || number > 65535)
    refuse(address, "expected HOST:PORT, a port from 1 to 65535");
}

std::unique_ptr<Link> connect(const std::string& address) {
  return std::make_unique<UdpLink>(address);
}

Endpoint::Endpoint(const std::string& address) {
  const sockaddr_in own = resolve(address);
  socket_ = open_socket(address);
  if (bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0) {
    const std::string why = std::strerror(errno);
    close(socket_);
    refuse(address, why);
  }
}

Endpoint::~Endpoint() { close(socket_); }

std::vector<Endpoint::Datagram> Endpoint::receive() {
  std::vector<Datagram> all;
  std::array<char, kLargest> buffer;
  for (std::size_t i = 0; i < kAtOnce; ++i) {
    sockaddr_in from{};
    socklen_t length = sizeof from;
    const ssize_t size = recvfrom(socket_, buffer.data(), buffer.size(), MSG_TRUNC,
                                  reinterpret_cast<sockaddr*>(&from), &length);
    if (size < 0) break;
    all.push_back({text(from), std::string(buffer.data(), std::min(static_cast<std::size_t>(size),
                                                                   buffer.size()))});
  }
  return all;
}

void Endpoint::send(const std::string& to, std::string_view bytes) {
  const sockaddr_in peer = resolve(to);
  sendto(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL,
         reinterpret_cast<const sockaddr*>(&peer), sizeof peer);
}

}  // namespace mimesis::hw::udp
