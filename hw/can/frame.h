#pragma once
#include <array>
#include <cstdint>

namespace mimesis::hw::can {

inline constexpr std::uint32_t kExtendedFlag = 0x80000000;  ///< id has 29 bits
inline constexpr std::uint32_t kRemoteFlag = 0x40000000;    ///< remote request
inline constexpr std::uint32_t kErrorFlag =
    0x20000000;  ///< message of the controller, not from the wire
inline constexpr std::uint32_t kBusOff =
    0x40;  ///< class bit of an error frame: no longer on the bus

/// One CAN or CAN FD frame. Same layout and meaning as the kernel's struct canfd_frame
/// (linux/can.h), so that it goes over sockets as it is.
struct Frame {
  std::uint32_t id = 0;     ///< identifier in bits 0-28, the flags above
  std::uint8_t length = 0;  ///< bytes of data in use: 0-8, on CAN FD up to 64
  std::uint8_t flags = 0;   ///< CAN FD: bit 0 bit-rate switch, bit 1 error state
  std::array<std::uint8_t, 2> reserved{};
  std::array<std::uint8_t, 64> data{};

  friend bool operator==(const Frame&, const Frame&) = default;
};
static_assert(sizeof(Frame) == 72);

}  // namespace mimesis::hw::can
