#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "hw/actuators.h"
#include "hw/can/bus.h"
#include "hw/sim/cia402/dictionary.h"
#include "hw/sim/cia402/habits.h"

namespace mimesis::hw::sim {

/// Callbacks of a slave to the device above it.
enum class Event : std::uint8_t {
  none,
  sync,             ///< set-points are in the dictionary; answer with send_synchronous()
  set_points,       ///< of an RPDO that does not wait for SYNC
  not_operational,  ///< no more PDOs
  reset_node,       ///< the device begins anew
  lost,             ///< the master, or its set-points, are missing
};

/// CANopen device [CiA 301], written from the standard's tables and not from the codec that it is
/// tested with: NMT, SDO server (expedited and segmented), four PDOs each way with free mapping and
/// all transmission types but remote ones, SYNC, heartbeat both ways, node guarding, RPDO
/// deadlines, emergencies. Pure: frames in, frames out, time as argument.
class Slave {
 public:
  using Frames = std::vector<can::Frame>;
  static constexpr int kPdos = 4;

  /// Adds the objects 1000h to 1FFFh to those of the device. @param name object 1008h
  Slave(int node, const std::string& name, std::uint32_t device_type,
        const SlaveHabits& habits = {});

  Dictionary objects;

  void boot(Frames& out);  ///< after power-on: boot-up message, pre-operational
  Event handle(const can::Frame& frame, Frames& out);
  /// Heartbeats, timed PDOs and watchdogs up to `now`, the device's own time.
  Event advance(Time now, Frames& out);
  void send_synchronous(Frames& out);
  /// Deadlines of set-points count from now.
  void watch_set_points();
  /// Emergency message; the bits stay in the error register until clear_error().
  void emergency(std::uint16_t code, std::uint8_t error_bits, Frames& out);
  void clear_error(Frames& out);  ///< 0000h, "error reset"

  bool operational() const { return state_ == kOperational; }

 private:
  enum State : std::uint8_t { kStopped = 4, kOperational = 5, kPreOperational = 127 };
  struct Transfer {  // segmented SDO
    bool up = false, toggle = false;
    Address address = 0;
    std::vector<std::uint8_t> data{};
    std::size_t done = 0;
    Time since{};
  };

  void reset_communication();
  void learn_identifiers();
  Event on_nmt(const can::Frame& frame, Frames& out);
  Event leave(State state);
  void on_sdo(const can::Frame& frame, Frames& out);
  void serve(const can::Frame& frame, Frames& out);
  void begin_upload(Address address, Frames& out);
  void begin_download(const can::Frame& frame, Address address, Frames& out);
  void next_upload(const can::Frame& frame, Frames& out);
  void next_download(const can::Frame& frame, Frames& out);
  std::uint32_t download(Address address, std::span<const std::uint8_t> data);
  std::uint32_t refuse(Address address, std::int64_t value) const;
  std::uint32_t refuse_mapping(Address address, std::int64_t value) const;
  void answer(std::uint8_t command, Address address, std::uint32_t value, Frames& out);
  void abort(Address address, std::uint32_t code, Frames& out);
  void on_guard_request(Frames& out);
  Event lose_master(Frames& out);
  Event take(int n, const can::Frame& frame, Frames& out);
  void unpack(int n, const can::Frame& frame);
  can::Frame packed(int n) const;
  Event watch(Frames& out);
  void end_error(std::uint8_t error_bits, Frames& out);

  int node_;
  SlaveHabits habits_;
  std::vector<std::pair<Time, can::Frame>> later_;  // answers of a slow SDO server
  State state_ = kPreOperational;
  Time now_{};
  std::optional<Transfer> transfer_;
  std::optional<Time> heartbeat_due_;
  std::array<std::optional<Time>, 2> master_seen_;  // of 1016h:01 and :02
  std::array<bool, 2> master_lost_{};
  std::optional<Time> guard_seen_;  // last request of node guarding
  bool guard_toggle_ = false, guard_lost_ = false;
  std::array<std::optional<Time>, kPdos> taken_;  // last RPDO, for its deadline
  std::array<bool, kPdos> late_{};
  std::array<std::optional<can::Frame>, kPdos> waiting_;  // RPDOs for the next SYNC
  std::array<std::uint32_t, kPdos> rpdo_id_{};
  std::array<int, kPdos> syncs_{};                  // since the last TPDO
  std::array<can::Frame, kPdos> sent_{};            // last TPDOs
  std::array<std::optional<Time>, kPdos> sent_at_;  // of TPDOs by event
};

}  // namespace mimesis::hw::sim
