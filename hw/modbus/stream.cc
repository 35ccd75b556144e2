#include "hw/modbus/stream.h"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>

namespace mimesis::hw::modbus {
namespace {

constexpr int kBacklog = 16;

sockaddr_un local_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(path.begin(), path.end(), address.sun_path);
  return address;
}

using AddressList = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

AddressList resolve(const Address& address, std::string& error) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int code = getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &found);
  if (code != 0) error = gai_strerror(code);
  return {code == 0 ? found : nullptr, &freeaddrinfo};
}

/// Waits for a connection begun on a non-blocking socket; 0 or the error.
int wait_connected(int socket, std::chrono::milliseconds timeout) {
  pollfd waiting{.fd = socket, .events = POLLOUT, .revents = 0};
  if (poll(&waiting, 1, static_cast<int>(timeout.count())) <= 0) return ETIMEDOUT;
  int error = 0;
  socklen_t size = sizeof(error);
  return getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size) < 0 ? errno : error;
}

/// Connects `socket` to one resolved address; 0 or the error.
int try_connect(int socket, const sockaddr* to, socklen_t size, std::chrono::milliseconds timeout) {
  int error = ::connect(socket, to, size) == 0 ? 0 : errno;
  if (error == EINPROGRESS) error = wait_connected(socket, timeout);
  if (error == 0) fcntl(socket, F_SETFL, 0);  // libmodbus waits by select
  return error;
}

}  // namespace

Address parse_address(const std::string& text, const std::string& directory) {
  Address address;
  address.text = text;
  const std::size_t first = text.find(':'), last = text.rfind(':');
  const std::string kind = text.substr(0, first);
  if (kind == "unix" && first + 1 < text.size() && text.find('/') == std::string::npos) {
    address.local = true;
    address.path = directory + "/" + text.substr(first + 1) + ".modbus";
    if (address.path.size() >= sizeof(sockaddr_un{}.sun_path)) {
      throw ConfigError("Modbus '" + text + "': the socket's path is too long: " + address.path);
    }
    return address;
  }
  if (kind == "tcp" && last > first + 1 && last + 1 < text.size()) {
    address.host = text.substr(first + 1, last - first - 1);
    address.port = text.substr(last + 1);
    return address;
  }
  if (kind == "rtu" && first + 1 < text.size() && text[first + 1] == '/') {
    address.device = text.substr(first + 1);
    return address;
  }
  throw ConfigError("Modbus '" + text + "': expected tcp:HOST:PORT, unix:NAME or rtu:/dev/NAME");
}

tl::expected<int, Status> connect(const Address& address, std::chrono::milliseconds timeout) {
  const auto failed = [&](const std::string& why) { return tl::unexpected(Status{why}); };
  if (address.local) {
    const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd < 0) return failed(std::strerror(errno));
    const sockaddr_un to = local_address(address.path);
    const int error = try_connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof(to), timeout);
    if (error == 0) return fd;
    close(fd);
    return failed(error == ENOENT ? "nobody serves there" : std::strerror(error));
  }
  std::string why;
  const AddressList found = resolve(address, why);
  for (const addrinfo* a = found.get(); a != nullptr; a = a->ai_next) {
    const int fd =
        ::socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol);
    if (fd < 0) continue;
    const int error = try_connect(fd, a->ai_addr, a->ai_addrlen, timeout);
    if (error == 0) {
      const int on = 1;  // a request is one small segment
      setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
      return fd;
    }
    close(fd);
    why = std::strerror(error);
  }
  return failed(why);
}

int listen(const Address& address) {
  const auto refuse = [&](const std::string& why) {
    throw ConfigError("Modbus server at " + address.text + ": " + why);
  };
  if (!address.device.empty()) refuse("expected tcp:HOST:PORT or unix:NAME");
  if (address.local) {
    if (const auto other = connect(address, std::chrono::milliseconds(50))) {
      close(*other);
      refuse("somebody serves there already");
    }
    unlink(address.path.c_str());  // left by a killed server
    const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const sockaddr_un at = local_address(address.path);
    if (fd < 0 || bind(fd, reinterpret_cast<const sockaddr*>(&at), sizeof(at)) < 0 ||
        ::listen(fd, kBacklog) < 0) {
      refuse(std::strerror(errno));
    }
    return fd;
  }
  std::string why;
  const AddressList found = resolve(address, why);
  for (const addrinfo* a = found.get(); a != nullptr; a = a->ai_next) {
    const int fd = ::socket(a->ai_family, a->ai_socktype | SOCK_CLOEXEC, a->ai_protocol);
    const int on = 1;
    if (fd >= 0 && setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on)) == 0 &&
        bind(fd, a->ai_addr, a->ai_addrlen) == 0 && ::listen(fd, kBacklog) == 0) {
      return fd;
    }
    why = std::strerror(errno);
    if (fd >= 0) close(fd);
  }
  refuse(why);
  return -1;
}

}  // namespace mimesis::hw::modbus
