#pragma once
#include <memory>
#include <optional>

#include "hw/modbus/stream.h"
#include "hw/sim/hand/registers.h"

namespace mimesis::hw::sim {

struct HandParams {
  double closing_time_s = 1.0;     ///< from open to closed at full speed [s]
  double activation_time_s = 0.5;  ///< from reset to ready [s]
  double mode_time_s = 0.3;        ///< to change the fingers' bases [s]
};

/// A hand of three fingers that move together:
///   closure ċ = ±s/T_close towards the request, s = 0.2 … 1 by the speed register,
/// until it arrives or, while closing, meets the object at the contact closure. Answers in the
/// registers' terms. Pure; time as argument.
class HandPlant {
 public:
  explicit HandPlant(const HandParams& params) : params_(params) {}

  /// Advances by `dt` [s]. @param contact closure at which the fingers touch an object, if one is
  /// reachable
  void step(double dt, const HandOutput& output, std::optional<double> contact);

  const HandInput& input() const { return input_; }
  double closure() const { return closure_; }  ///< 0 open .. 1 closed [1]: the truth

 private:
  void initialise(double dt, const HandOutput& output);
  void move(double dt, const HandOutput& output, std::optional<double> contact);

  HandParams params_;
  HandInput input_;
  double closure_ = 0.0;
  double left_s_ = 0.0;  // time left of activation or change of mode
};

/// Modbus server of a hand, TCP or on a serial line, on a thread of its own (libmodbus). Values
/// that clients read change only in `exchange`, so that in lock-step the thread's timing has no
/// effect.
class HandServer {
 public:
  /// @throws ConfigError if the address cannot be served
  explicit HandServer(const modbus::Address& address);
  ~HandServer();
  HandServer(const HandServer&) = delete;
  HandServer& operator=(const HandServer&) = delete;

  /// Shows `input` from now on; returns what clients have written last.
  HandOutput exchange(const HandInput& input);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mimesis::hw::sim
