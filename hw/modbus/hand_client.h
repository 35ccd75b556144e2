#pragma once
#include <chrono>
#include <memory>
#include <string>
#include <tl/expected.hpp>

#include "common/error.h"
#include "hw/actuators.h"
#include "hw/modbus/registers.h"
#include "hw/modbus/stream.h"

namespace mimesis::hw::modbus {

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

  std::uint64_t transactions() const { return transactions_; }  ///< answered requests
  std::uint64_t errors() const {
    return errors_;
  }  ///< refused connections, missing or wrong answers

 private:
  struct Connection;
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

}  // namespace mimesis::hw::modbus
