#pragma once
#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "hw/modbus/hand_client.h"
#include "hw/modbus/latest_slot.h"

namespace mimesis::hw::modbus {

/// What the hand shall do.
struct HandSetpoint {
  bool move = false;  ///< false: stand still
  HandMode mode = HandMode::basic;
  double closure = 0.0;  ///< 0 open .. 1 closed [1]
  double force = 0.0;    ///< 0 weakest .. 1 strongest [1]
};

struct HandReading {
  bool active = false;  ///< initialised, reachable, without fault
  HandMode mode = HandMode::basic;
  double closure = 0.0;  ///< 0 open .. 1 closed [1]
  bool moving = false;
  bool object_detected = false;  ///< stopped by contact while closing
  std::string fault;             ///< empty, or one line
  std::uint64_t transactions = 0, errors = 0;
};

/// Set-point to registers: activates the hand, and again after a fault that asks for it. Pure.
HandOutput to_output(const HandSetpoint& setpoint, const HandInput& last);
/// Registers to reading; `reachable` false: `failure` says why, all else is old.
HandReading to_reading(const HandInput& input);

/// The hand, either inside the step (lock-step: nothing may depend on threads) or on a thread of
/// its own, so that a slow hand never delays the arm.
class HandDriver {
 public:
  struct Options {
    bool threaded = true;
    std::chrono::milliseconds timeout{50};  ///< of each Modbus answer, wall time
    std::chrono::milliseconds period{10};   ///< of exchanges on the thread, wall time
  };
  HandDriver(Address address, const Options& options);
  ~HandDriver();
  HandDriver(const HandDriver&) = delete;
  HandDriver& operator=(const HandDriver&) = delete;

  /// Newest reading, after an exchange of this set-point (inside the step) or of an earlier one
  /// (thread).
  const HandReading& exchange(Time now, const HandSetpoint& setpoint);
  /// The fingers stand still; what they hold, they hold.
  void stop() noexcept;

 private:
  void exchange_now(Time now, const HandSetpoint& setpoint, HandReading& reading);
  void work();

  HandClient client_;
  Options options_;
  HandInput last_;
  HandReading reading_;
  LatestSlot<HandSetpoint> setpoints_;
  LatestSlot<HandReading> readings_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace mimesis::hw::modbus
