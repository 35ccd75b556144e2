#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace mimesis::hw::udp {

/// Datagrams to and from one controller. Never blocks.
class Link {
 public:
  virtual ~Link() = default;
  virtual bool send(std::string_view datagram) = 0;  ///< false: it did not leave
  virtual std::vector<std::string> receive() = 0;    ///< all that came since the last call
};

/// @throws ConfigError if it is not HOST:PORT
void check_address(const std::string& address);

/// @param address HOST:PORT; datagrams of other senders are not heard
/// @throws ConfigError
std::unique_ptr<Link> connect(const std::string& address);

/// The controller's side: a socket bound to HOST:PORT that answers whoever has sent last.
class Endpoint {
 public:
  /// @throws ConfigError
  explicit Endpoint(const std::string& address);
  ~Endpoint();
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

  /// A datagram with its sender's address, HOST:PORT.
  struct Datagram {
    std::string from, bytes;
  };
  std::vector<Datagram> receive();
  void send(const std::string& to, std::string_view bytes);

 private:
  int socket_ = -1;
};

}  // namespace mimesis::hw::udp
