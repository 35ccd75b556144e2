#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Datagrams between the bridge and a controller of joints; layout: hw/udp/README.md. Pure.
namespace mimesis::hw::udp {

/// What the bridge wants.
enum class Order : std::uint8_t { stop = 0, follow = 1, reset = 2 };

/// What the controller does.
enum class Condition : std::uint8_t { off = 0, enabling = 1, follows = 2, stopping = 3, fault = 4 };
const char* name(Condition condition);

struct Header {
  std::uint32_t session = 0;        ///< of the sender since its start
  std::uint32_t sequence = 0;       ///< of this datagram, from 1
  std::uint32_t heard = 0;          ///< sequence of the last one from the other side; 0: none
  std::uint32_t other_session = 0;  ///< of the other side; 0: none
};

struct Command {
  Header header;
  Order order = Order::stop;
  std::uint16_t watchdog_ms = 0;  ///< the controller stops after this time without a command
  std::vector<double> position_rad{}, velocity_rad_s{};  ///< set-points
};
std::string encode(const Command& command);

struct State {
  Header header;
  Condition condition = Condition::off;
  std::uint16_t fault = 0;  ///< the controller's own number
  std::vector<double> position_rad{}, velocity_rad_s{}, torque_n_m{};
};
/// Nothing if it is no state, or a number in it is not finite.
std::optional<State> decode_state(std::string_view bytes);

}  // namespace mimesis::hw::udp
