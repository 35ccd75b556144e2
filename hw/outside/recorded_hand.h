#pragma once
#include <memory>
#include <string>

#include "common/runtime/bus.h"
#include "hw/modbus/hand_driver.h"

namespace mimesis::hw::outside {

/// A hand as a node of the graph uses it: what goes to the driver and comes from it passes
/// `graph.outside()` under the name "hand". In a replay there is neither driver nor thread.
/// Layout, little-endian; logs rely on it:
///   written  u8 move, u8 mode, f64 closure, f64 force
///   read     u8 active + 2 moving + 4 object detected, u8 mode, f64 closure, u64 transactions,
///            u64 errors, the fault's text
class RecordedHand {
 public:
  /// @throws ConfigError as modbus::parse_address
  RecordedHand(const std::string& address, const modbus::HandDriver::Options& options,
               runtime::Bus& graph);

  /// As of modbus::HandDriver.
  const modbus::HandReading& exchange(Time now, const modbus::HandSetpoint& setpoint);
  void stop() noexcept;

 private:
  runtime::Bus& graph_;
  std::unique_ptr<modbus::HandDriver> driver_;  // none in a replay
  modbus::HandReading reading_;
};

}  // namespace mimesis::hw::outside
