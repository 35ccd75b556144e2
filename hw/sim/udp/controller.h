#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hw/actuators.h"

namespace mimesis::hw::sim {

struct ControllerConfig {
  std::vector<double> home_rad;       ///< posture at power-on
  std::vector<double> v_max_rad_s;    ///< a faster set-point is fault 1
  std::vector<double> a_max_rad_s2;   ///< deceleration of a stop
  double enabling_s = 0.05;           ///< from the first order to follow
  double start_tolerance_rad = 0.05;  ///< a farther first set-point is fault 2
  std::uint32_t session = 1;          ///< another one for each start
};

/// The controller of an arm that is commanded by datagrams, written from the layout in
/// hw/udp/README.md and not from the driver's code. The joints are where their set-points are.
/// Pure; time as argument.
class Controller {
 public:
  explicit Controller(const ControllerConfig& config);

  /// A datagram of `from`; the first master counts until it is silent for its watchdog.
  void handle(const std::string& from, std::string_view bytes, Time now);
  /// Moves the joints.
  void advance(Time now);
  std::string state();                                 ///< the next datagram, for master()
  const std::string& master() const { return from_; }  ///< who sent last; empty: nobody has

  void fail(std::uint16_t number);  ///< a fault of its own
  void jam(bool on) { jammed_ = on; }

  const std::vector<double>& position_rad() const { return position_; }
  const std::vector<double>& velocity_rad_s() const { return velocity_; }
  bool follows() const { return condition_ == kFollows; }

 private:
  enum Condition : std::uint8_t {
    kOff = 0,
    kEnabling = 1,
    kFollows = 2,
    kStopping = 3,
    kFault = 4
  };
  void enter(Condition condition, Time now);
  void follow(std::string_view bytes, std::size_t n, Time now);

  ControllerConfig config_;
  std::string from_;
  std::uint32_t session_ = 0, heard_ = 0, sequence_ = 0;  // the master's; ours
  Condition condition_ = kOff;
  std::uint16_t fault_ = 0;
  bool may_follow_ = false, jammed_ = false;  // an order to stop has come
  Time entered_{}, watchdog_{};
  std::optional<Time> now_, commanded_;
  std::vector<double> position_, velocity_, goal_;
};

}  // namespace mimesis::hw::sim
