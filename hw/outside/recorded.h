#pragma once
#include <memory>
#include <string>

#include "common/runtime/bus.h"
#include "hw/can/bus.h"
#include "hw/modbus/hand.h"
#include "hw/modbus/stop_input.h"
#include "hw/udp/link.h"

namespace mimesis::hw::outside {

/// A CAN bus for a node of the graph: all traffic goes through `graph.outside()` under the name
/// "can". Layout, little-endian; logs rely on it:
///   FRAMES  u32 count, then per frame: u32 id with its flags, u8 length, u8 flags of CAN FD,
///           `length` bytes of data
///   send     writes FRAMES, then reads the result: u32 taken by the wire, u32 errors
///   receive  reads u32 errors since the last call, FRAMES
/// A node sees only recorded data, in a live run too: unused bytes of a frame are zero.
/// @param wire not used in a replay, may be null then
std::unique_ptr<can::Bus> record_can(std::unique_ptr<can::Bus> wire, runtime::Bus& graph);

/// The bus at `address` (hw/can/bus.h), recorded; in a replay nothing is opened. `role` and `of`:
/// see runtime::Opening.
/// @throws ConfigError as can::open
std::unique_ptr<can::Bus> open_can(const std::string& address, runtime::Bus& graph,
                                   const std::string& role = {}, const std::string& of = {});

/// A hand for a node of the graph: data to the driver and from it pass `graph.outside()` under the
/// name "hand". In a replay there is neither driver nor thread. Layout, little-endian; logs rely on
/// it:
///   written  u8 move, u8 mode, f64 closure, f64 force
///   read     u8 active + 2 moving + 4 object detected, u8 mode, f64 closure, u64 transactions,
///            u64 errors, the fault's text
class RecordedHand {
 public:
  /// @throws ConfigError as modbus::parse_address
  RecordedHand(const std::string& address, const modbus::HandProfile& profile,
               const modbus::HandDriver::Options& options, runtime::Bus& graph);

  const modbus::HandReading& exchange(Time now, const modbus::HandSetpoint& setpoint);
  void stop() noexcept;

 private:
  runtime::Bus& graph_;
  std::unique_ptr<modbus::HandDriver> driver_;  // null in a replay
  modbus::HandReading reading_;
};

/// The controller at `address` (hw/udp/link.h) for a node of the graph: its datagrams pass
/// `graph.outside()` under the name "udp"; in a replay nothing is opened. Layout, little-endian:
///   send     writes the datagram, then reads u8: it left
///   receive  reads for each datagram u32 length, its bytes
/// `of`: see runtime::Opening.
/// @throws ConfigError as udp::connect
std::unique_ptr<udp::Link> open_udp(const std::string& address, runtime::Bus& graph,
                                    const std::string& of);

/// The controller's side likewise; what is received is, for each datagram, u32 length, HOST:PORT,
/// u32 length, its bytes.
class RecordedEndpoint {
 public:
  /// @throws ConfigError as udp::Endpoint
  RecordedEndpoint(const std::string& address, runtime::Bus& graph, const std::string& of);
  std::vector<udp::Endpoint::Datagram> receive();
  void send(const std::string& to, std::string_view bytes);

 private:
  runtime::Bus& graph_;
  std::unique_ptr<udp::Endpoint> endpoint_;  // null in a replay
};

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
