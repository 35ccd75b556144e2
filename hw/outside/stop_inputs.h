#pragma once
#include <memory>
#include <string>

#include "common/runtime/bus.h"
#include "hw/modbus/stop_input.h"

namespace mimesis::hw::outside {

/// What demands an emergency stop from outside of the graph: signal SIGUSR1, and a circuit at a
/// Modbus server. Passes `graph.outside()` under the name "stop" in each step, as text.
class StopInputs {
 public:
  /// @param address as modbus::parse_address; empty: the signal alone. One per process.
  /// @throws ConfigError
  StopInputs(const std::string& address, int unit, int input, runtime::Bus& graph);
  ~StopInputs();
  StopInputs(const StopInputs&) = delete;
  StopInputs& operator=(const StopInputs&) = delete;

  /// Why the joints are to stop now; empty: they need not. Of a signal once.
  std::string demanded();

 private:
  runtime::Bus& graph_;
  std::unique_ptr<modbus::StopInput> circuit_;
};

}  // namespace mimesis::hw::outside
