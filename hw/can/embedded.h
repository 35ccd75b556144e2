#pragma once
#include <sys/un.h>

#include <string>
#include <vector>

#include "hw/can/bus.h"

namespace mimesis::hw::can {

/// A CAN bus without CAN: every participant is a Unix datagram socket in DIRECTORY/can-NAME, every
/// frame goes to all other sockets there. A batch travels as one datagram of canfd_frames back to
/// back: a socket holds only net.unix.max_dgram_qlen + 1 = 11 datagrams, fewer than the frames of
/// one cycle of eight axes, and a batch arrives whole. Sockets of the dead are found by the refused
/// connection and removed.
class EmbeddedBus final : public Bus {
 public:
  /// @throws ConfigError if the folder or the socket cannot be made
  EmbeddedBus(const std::string& name, const std::string& directory);
  ~EmbeddedBus() override;
  EmbeddedBus(const EmbeddedBus&) = delete;
  EmbeddedBus& operator=(const EmbeddedBus&) = delete;

  void send(std::span<const Frame> frames) override;
  std::size_t receive(std::span<Frame> frames) override;

  static constexpr std::size_t kBatch = 64;  ///< most frames per datagram

 private:
  void find_peers();
  void forget_dead(std::size_t peer);
  bool send_to_all(std::span<const Frame> batch);

  std::string folder_, path_;
  int socket_ = -1;
  int watch_ = -1;  // inotify on the folder: who comes and goes
  std::vector<sockaddr_un> peers_;
  std::vector<Frame> arrived_;  // last datagram, consumed from `next_`
  std::size_t count_ = 0, next_ = 0;
};

}  // namespace mimesis::hw::can
