#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "hw/actuators.h"

namespace mimesis::hw::can {

inline constexpr std::uint32_t kExtendedFlag = 0x80000000;  ///< id has 29 bits
inline constexpr std::uint32_t kRemoteFlag = 0x40000000;    ///< remote request
inline constexpr std::uint32_t kErrorFlag =
    0x20000000;  ///< message of the controller, not from the wire
inline constexpr std::uint32_t kBusOff =
    0x40;  ///< class bit of an error frame: no longer on the bus

inline constexpr std::uint32_t kControllerState = 0x04;  ///< class bit: see data[1]
inline constexpr std::uint8_t kPassive = 0x30;           ///< bits of data[1]: error-passive

inline constexpr std::uint8_t kFd = 0x04;  ///< of Frame::flags: a CAN FD frame, which may be short

/// One CAN or CAN FD frame. Same layout and meaning as the kernel's struct canfd_frame
/// (linux/can.h), so that it goes over sockets as it is.
struct Frame {
  std::uint32_t id = 0;     ///< identifier in bits 0-28, the flags above
  std::uint8_t length = 0;  ///< bytes of data in use: 0-8, on CAN FD up to 64
  std::uint8_t flags = 0;   ///< CAN FD: bit 0 bit-rate switch, bit 1 error state, kFd
  std::array<std::uint8_t, 2> reserved{};
  std::array<std::uint8_t, 64> data{};

  friend bool operator==(const Frame&, const Frame&) = default;
};
static_assert(sizeof(Frame) == 72);

/// What keeps our controller from the bus, if this frame says so: "bus-off", "error-passive". Else
/// null.
const char* trouble(const Frame& frame);

/// Bits of a classic frame with an 11-bit identifier and `bytes` of data on the wire, with the
/// three bits before the next frame: start 1, identifier and control 18, data, CRC 15, and 13 that
/// are never stuffed. [Bosch CAN 2.0, 3.1]
constexpr int least_bits(int bytes) { return 47 + 8 * bytes; }

/// The same with the most stuff bits: the first 34 + 8n bits can hold one after every fifth bit,
/// and after each fourth from then on, since a stuff bit counts: ⌊(34 + 8n − 1)/4⌋.
constexpr int worst_bits(int bytes) { return least_bits(bytes) + (34 + 8 * bytes - 1) / 4; }

/// Chooses frames by their identifier: those with (id ^ this id) & mask == 0.
struct Wanted {
  std::uint32_t id = 0, mask = 0;
};

/// Moves frames, knows nothing of their meaning. Every participant receives all frames but its own.
class Bus {
 public:
  virtual ~Bus() = default;

  /// Hands frames to the wire in one batch. Never blocks and keeps nothing for later: frames that
  /// the wire does not take now are dropped and counted, so that no stale command waits in a queue.
  virtual void send(std::span<const Frame> frames) = 0;

  /// Takes frames that have arrived, oldest first; never blocks. Error frames are among them.
  /// @return how many of `frames` were filled; if all, there may be more
  virtual std::size_t receive(std::span<Frame> frames) = 0;

  /// When each frame of the last receive() arrived, since 1970, by the interface's own clock if it
  /// has one; empty if the bus does not know.
  virtual std::span<const std::chrono::nanoseconds> stamps() const { return {}; }

  /// Nobody needs frames other than these. A bus that can lets the kernel drop them; others go on
  /// to bring them. Error frames come in any case.
  virtual void want(std::span<const Wanted>) {}

  /// Frames since the bus was opened: sent are those that the wire took, received all but error
  /// frames, errors those that were not taken, and error frames.
  const Traffic& counters() const { return counters_; }

 protected:
  Traffic counters_;
};

/// Opens the bus at `address`:
///   embedded:NAME    Unix datagram sockets below `directory` (the graph's), no CAN in the kernel
///   socketcan:IFACE  the kernel's CAN interface
///   slcan:/dev/NAME  an adapter on a serial line, see open_slcan
/// @throws ConfigError with one line: unknown kind, no such interface, interface down, no CAN in
/// the kernel
std::unique_ptr<Bus> open(const std::string& address, const std::string& directory);

/// @throws ConfigError unless the address is one of these.
void check_address(const std::string& address);

/// Appends the adapter's `tIIILDD..\r` (T: 29 bits, r, R: remote). False, and nothing, for an FD or
/// error frame.
bool to_line(const Frame& frame, std::string& out);
/// A line without its `\r`: a frame, or an error frame for s (state) and e (bus errors). Nothing
/// for other answers of the adapter.
std::optional<Frame> from_line(std::string_view line);

/// Opens an adapter on a serial line that speaks the ASCII protocol of Lawicel and reports states
/// and errors as the kernel's slcan driver knows them (drivers/net/can/slcan). No CAN FD.
/// @param device  /dev/NAME, or /dev/NAME@BITRATE, default 1000000. @throws ConfigError
std::unique_ptr<Bus> open_slcan(const std::string& device);

}  // namespace mimesis::hw::can
