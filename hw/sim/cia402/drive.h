#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "hw/can/bus.h"
#include "hw/cia402/axis.h"
#include "hw/cia402/canopen.h"
#include "hw/cia402/cia402.h"
#include "hw/sim/cia402/plant.h"

namespace mimesis::hw::sim {

enum class Access : std::uint8_t { read_only, read_write };

/// Object dictionary of a simulated CANopen node: numbers of 1, 2 or 4 bytes. Answers according to
/// CiA 301: 0, or the SDO abort code.
class Dictionary {
 public:
  void add(cia402::Object object, int bytes, Access access, std::uint32_t value);

  std::uint32_t get(cia402::Object object) const;  ///< precondition: exists
  std::int32_t get_signed(cia402::Object object) const;
  void set(cia402::Object object,
           std::uint32_t value);  ///< from inside the node, regardless of the access type
  bool contains(cia402::Object object) const { return entries_.contains(key(object)); }
  int bytes(cia402::Object object) const { return entries_.at(key(object)).bytes; }

  /// Abort code of reading or of writing `bytes` bytes; 0 if it is allowed.
  std::uint32_t refuse_upload(cia402::Object object) const;
  std::uint32_t refuse_download(cia402::Object object, int bytes) const;

 private:
  struct Entry {
    int bytes;
    Access access;
    std::uint32_t value;
  };
  static std::uint32_t key(cia402::Object o) { return std::uint32_t{o.index} << 8 | o.sub; }

  std::map<std::uint32_t, Entry> entries_;
};

enum class Trouble : std::uint8_t {
  overcurrent,  ///< the drive finds an error: fault
  mute,         ///< its bus cable is cut: it neither receives nor sends
  jam,          ///< the joint meets an obstacle: following error
};

struct DriveConfig {
  cia402::Axis axis{};
  PlantParams plant{};
  bool in_a_world = false;             ///< a physics world moves the joint: Drive::world_joint
  double home_rad = 0.0;               ///< position at power-on
  int extrapolated_cycles = 0;         ///< without a set-point it goes on at its rate for so long
  double following_window_rad = 0.05;  ///< default of 6065h
  double following_time_s = 0.05;      ///< default of 6066h
};

/// A CiA 402 drive in cyclic synchronous position mode on CANopen: NMT, SDO server, PDOs with real
/// mapping, SYNC, heartbeat producer and consumer, emergency messages, state machine, quick stop.
/// Pure: frames in, frames out, time as argument.
class Drive {
 public:
  explicit Drive(const DriveConfig& config);

  /// Motion and watchdogs from the last call up to `now`; appends the drive's own messages.
  void advance(Time now, std::vector<can::Frame>& out) {
    move(now, out);
    watch(out);
  }
  /// The two halves of `advance`: between them a physics world moves the joint.
  void move(Time now, std::vector<can::Frame>& out);
  void watch(std::vector<can::Frame>& out);
  /// One frame from the bus; appends answers.
  void handle(const can::Frame& frame, std::vector<can::Frame>& out);
  void inject(Trouble trouble);

  /// State of the joint: the truth, or readings of a world's sensors.
  double position_rad() const;
  double velocity_rad_s() const;
  double torque_n_m() const;
  DriveState state() const { return state_; }
  /// Precondition: DriveConfig::in_a_world.
  WorldJoint& world_joint() { return std::get<WorldJoint>(joint_); }
  const WorldJoint& world_joint() const { return std::get<WorldJoint>(joint_); }

 private:
  void reset_communication();
  void boot(std::vector<can::Frame>& out);
  void move_joint(double dt);
  bool lags() const;
  bool at_rest() const;
  double held() const;
  void supervise(std::vector<can::Frame>& out);
  cia402::QuickStop quick_stop() const;
  void update_objects();
  void on_nmt(const can::Frame& frame, std::vector<can::Frame>& out);
  void on_sdo(const can::Frame& frame, std::vector<can::Frame>& out);
  std::uint32_t download(const cia402::Sdo& request);
  std::uint32_t check_mapping(const cia402::Sdo& request) const;
  void on_rpdo(const can::Frame& frame);
  void on_sync(std::vector<can::Frame>& out);
  void obey(std::uint16_t controlword);
  void fail(std::uint16_t code, std::vector<can::Frame>& out);
  void connection_lost(std::uint16_t code, std::vector<can::Frame>& out);
  double period_s() const;
  double deceleration() const;

  DriveConfig config_;
  std::variant<AxisPlant, WorldJoint> joint_;
  Dictionary objects_;
  cia402::NmtState nmt_ = cia402::NmtState::boot_up;
  DriveState state_ = DriveState::switch_on_disabled;
  std::uint16_t controlword_ = 0;                  // obeyed last
  double reference_ = 0.0, reference_rate_ = 0.0;  // interpolated set-point [rad], [rad/s]
  double moves_on_s_ = 0.0;                        // how long the reference still moves
  double lag_s_ = 0.0;                             // how long the following error is too large
  double moved_s_ = 0.0;                           // in the last move
  Time now_{};                                     // of the last move
  Time own_time_{};  // sum of all moves, of heartbeat and watchdogs: never goes back
  bool started_ = false, mute_ = false;
  std::optional<Trouble> trouble_;
  std::optional<Time> heartbeat_due_, master_seen_, rpdo_seen_;
};

/// Simulated drives that share one participant of a bus.
class Rack {
 public:
  Rack(const std::vector<DriveConfig>& configs, std::unique_ptr<can::Bus> bus);

  /// Moves all drives up to `now` and lets them answer what has arrived, in one batch. A drive does
  /// not wait because this process had to: several SYNCs are taken as even in time since the last
  /// step, if that is not longer ago than a bus keeps frames (50 ms).
  void step(Time now);
  /// With a physics world that moves the joints in between: all that has arrived counts from `now`.
  void move(Time now);
  void answer();

  std::vector<Drive>& drives() { return drives_; }
  const std::vector<Drive>& drives() const { return drives_; }
  const can::Counters& counters() const { return bus_->counters(); }

 private:
  void receive();
  void answer(std::span<const can::Frame> frames);

  std::unique_ptr<can::Bus> bus_;
  std::vector<Drive> drives_;
  std::optional<Time> stepped_;
  std::vector<can::Frame> inbox_, outbox_;
};

}  // namespace mimesis::hw::sim
