#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "hw/actuators.h"
#include "hw/can/bus.h"

namespace mimesis::hw::sim {

struct ModuleConfig {
  int module = 1;             ///< 1..31
  double position_rad = 0.0;  ///< at power-on
  bool homed = true;          ///< absolute encoder; else command 01 comes first
  double v_max_rad_s = 2.0;
  double deceleration_rad_s2 = 10.0;
  Time watchdog =
      std::chrono::milliseconds(100);  ///< without a refresh for longer, if enabled: halt
};

/// A PowerCube module on a CAN bus, written from the tables of the protocol and not from the
/// driver's codec: parameters, motion by steps of position and time, halt and reset, watchdog,
/// following error. It speaks only when asked. Pure; time as argument.
class Module {
 public:
  explicit Module(const ModuleConfig& config);

  void advance(Time now);
  void handle(const can::Frame& frame, std::vector<can::Frame>& out);
  void jam() { jammed_ = true; }         ///< an obstacle holds it: following error
  void cut(bool off) { silent_ = off; }  ///< its cable

  double position_rad() const { return position_; }
  double velocity_rad_s() const { return velocity_; }
  std::uint32_t state() const;

 private:
  void command(const can::Frame& frame, std::vector<can::Frame>& out);
  void halt(std::uint32_t because = 0);

  ModuleConfig config_;
  std::map<std::uint8_t, std::uint32_t> parameters_;
  double position_, velocity_ = 0.0;
  double target_, rate_ = 0.0;  // of the present step
  double left_s_ = 0.0;         // of it
  std::uint32_t flags_ = 0;     // that stay until a reset
  bool homed_, jammed_ = false, silent_ = false;
  std::optional<Time> now_, refreshed_;
};

}  // namespace mimesis::hw::sim
