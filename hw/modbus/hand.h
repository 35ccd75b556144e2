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
#include "hw/modbus/hand_profile.h"
#include "hw/modbus/latest_slot.h"
#include "hw/modbus/stream.h"

namespace mimesis::hw::modbus {

class Connection;

/// Exchanges registers with the hand. Connects by itself, and again after an error, with growing
/// pauses. An exchange blocks for at most a time-out a block of registers. A device that has not
/// shown that it is the profile's is not moved; one that shows the contrary is a failure.
class HandClient {
 public:
  /// @param timeout of connecting and of each answer, wall time
  HandClient(Address address, HandProfile profile, std::chrono::milliseconds timeout);
  ~HandClient();
  HandClient(const HandClient&) = delete;
  HandClient& operator=(const HandClient&) = delete;

  /// Writes what has changed, reads the hand's state. `now` counts the pauses between attempts.
  tl::expected<HandReading, Status> exchange(Time now, const HandSetpoint& setpoint);
  /// From now on waits for 0.2 s at most: the process ends.
  void hurry();

  std::uint64_t transactions() const { return transactions_; }  ///< answered requests
  /// refused connections, missing or wrong answers, another device
  std::uint64_t errors() const { return errors_; }

 private:
  tl::unexpected<Status> fail(Time now, const std::string& why);
  std::string open();
  std::string read(const std::vector<RegisterBlock>& blocks);
  std::string write(const HandRegisters& registers);
  std::string blame(const RegisterBlock& block, const std::string& why) const;

  Address address_;
  HandProfile profile_;
  std::chrono::milliseconds timeout_;
  std::unique_ptr<Connection> connection_;
  HandRegisters image_;    // what was read on this connection
  HandRegisters written_;  // on this connection
  bool proven_ = false;    // on this connection
  bool met_ = false;       // on any
  Time retry_at_{};
  Time pause_;
  std::string last_failure_;
  std::uint64_t transactions_ = 0, errors_ = 0;
};

/// The hand, either inside the step (lock-step: nothing may depend on threads) or on a thread of
/// its own, so that a slow hand never delays the arm.
class HandDriver {
 public:
  struct Options {
    bool threaded = true;
    /// longest wait for each Modbus answer, wall time; 0: the profile's
    std::chrono::milliseconds timeout{0};
    std::chrono::milliseconds period{10};  ///< period of exchanges on the thread, wall time
  };
  HandDriver(Address address, const HandProfile& profile, const Options& options);
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
  HandMode mode_ = HandMode::basic;  // of the last set-point
  HandReading reading_;
  LatestSlot<HandSetpoint> setpoints_;
  LatestSlot<HandReading> readings_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace mimesis::hw::modbus
