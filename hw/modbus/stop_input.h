#pragma once
#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "hw/modbus/latest_slot.h"
#include "hw/modbus/stream.h"

namespace mimesis::hw::modbus {

class Connection;

/// The circuit of an emergency stop at a discrete input of a Modbus server (function 02), which is
/// 1 while the circuit is closed. Whatever is not known to be closed is open: a wire that has
/// broken, a server that is silent. On a thread of its own, 50 times a second; in lock-step inside
/// the step.
class StopInput {
 public:
  /// @param input address of the discrete input, from 0
  /// @param timeout of connecting and of each answer, wall time
  StopInput(Address address, int unit, int input, bool threaded, std::chrono::milliseconds timeout);
  ~StopInput();
  StopInput(const StopInput&) = delete;
  StopInput& operator=(const StopInput&) = delete;

  /// Empty while the circuit is closed, or why it is not taken as closed. Never blocks if threaded.
  std::string open();

 private:
  using Clock = std::chrono::steady_clock;
  struct Answer {
    std::string why = "has not answered yet";
    Clock::time_point at{};
  };
  Answer ask();
  void work();

  Address address_;
  int unit_, input_;
  bool threaded_;
  std::chrono::milliseconds timeout_;
  std::unique_ptr<Connection> connection_;
  Answer last_;
  LatestSlot<Answer> answers_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace mimesis::hw::modbus
