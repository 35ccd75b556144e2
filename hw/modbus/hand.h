#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <tl/expected.hpp>

#include "common/error.h"
#include "hw/actuators.h"
#include "hw/modbus/latest_slot.h"
#include "hw/modbus/registers.h"
#include "hw/modbus/stream.h"

namespace mimesis::hw::modbus {

class Connection;

/// Exchanges registers with the hand through libmodbus. Connects by itself, and again after an
/// error, with growing pauses. An exchange blocks for at most two time-outs.
class HandClient {
 public:
  /// @param timeout of connecting and of each answer, wall time
  HandClient(Address address, std::chrono::milliseconds timeout);
  ~HandClient();
  HandClient(const HandClient&) = delete;
  HandClient& operator=(const HandClient&) = delete;

  /// Writes `output` if it has changed, reads the hand's state. `now` counts the pauses between
  /// attempts.
  tl::expected<HandInput, Status> exchange(Time now, const HandOutput& output);
  /// From now on waits for 0.2 s at most: the process ends.
  void hurry();

  std::uint64_t transactions() const { return transactions_; }  ///< answered requests
  /// refused connections, missing or wrong answers
  std::uint64_t errors() const { return errors_; }

 private:
  tl::unexpected<Status> fail(Time now, const std::string& why);

  Address address_;
  std::chrono::milliseconds timeout_;
  std::unique_ptr<Connection> connection_;
  HandOutput written_;
  bool written_once_ = false;  // on this connection
  Time retry_at_{};
  Time pause_;
  std::string last_failure_;
  std::uint64_t transactions_ = 0, errors_ = 0;
};

/// Set-point of the hand.
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

/// Set-point to registers: activates the hand, and again after a fault that requires it. Pure.
HandOutput to_output(const HandSetpoint& setpoint, const HandInput& last);
/// Registers to reading; `reachable` false: `failure` has the reason, other values are old.
HandReading to_reading(const HandInput& input);

/// The hand, either inside the step (lock-step: nothing may depend on threads) or on a thread of
/// its own, so that a slow hand never delays the arm.
class HandDriver {
 public:
  struct Options {
    bool threaded = true;
    std::chrono::milliseconds timeout{50};  ///< longest wait for each Modbus answer, wall time
    std::chrono::milliseconds period{10};   ///< period of exchanges on the thread, wall time
  };
  HandDriver(Address address, const Options& options);
  ~HandDriver();
  HandDriver(const HandDriver&) = delete;
  HandDriver& operator=(const HandDriver&) = delete;

  /// Newest reading, after an exchange of this set-point (inside the step) or of an earlier one
  /// (thread).
  const HandReading& exchange(Time now, const HandSetpoint& setpoint);
  /// The fingers stand still and keep the object.
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
