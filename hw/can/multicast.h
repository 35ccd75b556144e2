#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "hw/can/bus.h"

/// The bus `udp_multicast` of python-can 4, for programs of others: a datagram per frame on a
/// multicast group, a msgpack map with str keys (can/interfaces/udp_multicast/utils.py).
namespace mimesis::hw::can {

inline constexpr std::uint16_t kMulticastPort = 43113;
inline constexpr std::size_t kMulticastBytes = 256;  ///< at least as long as any datagram

/// Appends the map to `out`. @param time_s since 1970
void pack(const Frame& frame, double time_s, std::string& out);
/// Nothing if the bytes are no such map, or the frame is none.
std::optional<Frame> unpack(std::span<const std::uint8_t> bytes);

/// Joins a group (239.74.163.2 is python-can's) on the loopback interface: nothing leaves this
/// machine. @throws ConfigError
std::unique_ptr<Bus> open_multicast(const std::string& group);

}  // namespace mimesis::hw::can
