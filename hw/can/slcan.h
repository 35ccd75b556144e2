#pragma once
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "hw/can/bus.h"

/// Adapters on a serial line that speak the ASCII protocol of Lawicel, and the reports of states
/// and errors that the kernel's slcan driver knows (drivers/net/can/slcan). No CAN FD.
namespace mimesis::hw::can {

/// Appends `tIIILDD..\r` (T: 29 bits, r, R: remote). False, and nothing, for an FD or error frame.
bool to_line(const Frame& frame, std::string& out);
/// A line without its `\r`: a frame, or an error frame for s (state) and e (bus errors). Nothing
/// for other answers of the adapter.
std::optional<Frame> from_line(std::string_view line);

/// Opens an adapter: /dev/NAME, or /dev/NAME@BITRATE, default 1000000. @throws ConfigError
std::unique_ptr<Bus> open_slcan(const std::string& device);

}  // namespace mimesis::hw::can
