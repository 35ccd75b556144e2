#include "hw/can/socketcan.h"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "common/error.h"

namespace mimesis::hw::can {
namespace {

static_assert(sizeof(Frame) == sizeof(canfd_frame));
constexpr std::size_t kBatch = 64;  // frames per system call

}  // namespace

SocketCan::SocketCan(const std::string& interface) {
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
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
  if (setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &all_errors, sizeof(all_errors)) < 0 ||
      setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof(on)) < 0 ||
      bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) < 0) {
    refuse(std::strerror(errno));
  }
}

SocketCan::~SocketCan() { close(socket_); }

void SocketCan::send(std::span<const Frame> frames) {
  while (!frames.empty()) {
    const auto batch = frames.first(std::min(frames.size(), kBatch));
    std::array<iovec, kBatch> parts{};
    std::array<mmsghdr, kBatch> messages{};
    for (std::size_t i = 0; i < batch.size(); ++i) {
      // A classic frame is the head of an FD frame; its size tells the kernel which one it gets.
      parts[i] = {const_cast<Frame*>(&batch[i]),
                  batch[i].length > CAN_MAX_DLEN ? CANFD_MTU : CAN_MTU};
      messages[i].msg_hdr.msg_iov = &parts[i];
      messages[i].msg_hdr.msg_iovlen = 1;
    }
    const int taken = sendmmsg(socket_, messages.data(), static_cast<unsigned>(batch.size()), 0);
    const std::size_t sent = taken < 0 ? 0 : static_cast<std::size_t>(taken);
    counters_.sent += sent;
    if (sent <
        batch.size()) {  // ENOBUFS, or the interface went down: the next cycle has newer frames
      counters_.errors += frames.size() - sent;
      return;
    }
    frames = frames.subspan(batch.size());
  }
}

std::size_t SocketCan::receive(std::span<Frame> frames) {
  std::size_t filled = 0;
  while (filled < frames.size()) {
    const std::size_t room = std::min(frames.size() - filled, kBatch);
    std::array<iovec, kBatch> parts{};
    std::array<mmsghdr, kBatch> messages{};
    for (std::size_t i = 0; i < room; ++i) {
      frames[filled + i] = Frame{};
      parts[i] = {&frames[filled + i], sizeof(Frame)};
      messages[i].msg_hdr.msg_iov = &parts[i];
      messages[i].msg_hdr.msg_iovlen = 1;
    }
    const int got =
        recvmmsg(socket_, messages.data(), static_cast<unsigned>(room), MSG_DONTWAIT, nullptr);
    if (got <= 0) break;
    for (std::size_t i = 0; i < static_cast<std::size_t>(got); ++i) {
      const Frame& frame = frames[filled + i];
      ++((frame.id & kErrorFlag) != 0 ? counters_.errors : counters_.received);
    }
    filled += static_cast<std::size_t>(got);
  }
  return filled;
}

}  // namespace mimesis::hw::can
