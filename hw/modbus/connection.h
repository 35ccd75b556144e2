#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "hw/modbus/stream.h"

namespace mimesis::hw::modbus {

/// Settings of a serial line; 8 data bits.
struct Line {
  int baud_bit_s = 115'200;
  char parity = 'N';  ///< N, E or O; without one there is one stop bit, too
};

/// A Modbus client's connection that stands: MBAP frames on a stream, or RTU on a serial line.
class Connection {
 public:
  using Bytes = std::vector<std::uint8_t>;

  /// At most `timeout` of wall time, as later each answer. @param unit of the server
  static tl::expected<std::unique_ptr<Connection>, Status> open(const Address& address, int unit,
                                                                std::chrono::milliseconds timeout,
                                                                const Line& line = {});
  virtual ~Connection() = default;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// One request (function code and data), and its answer. What belongs to another transaction or
  /// unit is passed over. Failures: no answer in time, an exception, rubbish, a lost connection.
  tl::expected<Bytes, Status> ask(std::span<const std::uint8_t> request);
  /// Registers from `address` on, by function 3 or 4.
  tl::expected<std::vector<std::uint16_t>, Status> read(int function, int address, int count);
  /// By function 16.
  tl::expected<void, Status> write(int address, std::span<const std::uint16_t> values);

  virtual void set_timeout(std::chrono::milliseconds timeout) { timeout_ = timeout; }
  /// The last failure was an answer: the server is there, and refuses.
  bool refused() const { return refused_; }

 protected:
  Connection(int unit, std::chrono::milliseconds timeout) : unit_(unit), timeout_(timeout) {}
  virtual tl::expected<Bytes, Status> exchange(std::span<const std::uint8_t> request) = 0;
  Status silence(int others) const;  ///< no answer in time

  int unit_;
  std::chrono::milliseconds timeout_;

 private:
  bool refused_ = false;
};

}  // namespace mimesis::hw::modbus
