#pragma once
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "hw/arm/axis.h"
#include "hw/arm/cia402.h"
#include "hw/sim/drives/axis_plant.h"
#include "hw/sim/drives/dictionary.h"
#include "hw/sim/drives/world_joint.h"

namespace mimesis::hw::sim {

/// Trouble on command.
enum class Trouble : std::uint8_t {
  overcurrent,  ///< the drive finds an error: fault
  mute,         ///< its bus cable is cut: it neither hears nor speaks
  jam,          ///< the joint meets an obstacle: following error
};

struct DriveConfig {
  arm::Axis axis{};
  PlantParams plant{};
  bool in_a_world = false;             ///< a physics world moves the joint: Drive::world_joint
  double home_rad = 0.0;               ///< position at power-on
  double following_window_rad = 0.05;  ///< default of 6065h
  double following_time_s = 0.05;      ///< default of 6066h
};

/// A CiA 402 drive in cyclic synchronous position mode on CANopen: NMT, SDO server, PDOs with real
/// mapping, SYNC, heartbeat producer and consumer, emergency messages, state machine, quick stop.
/// Pure: frames in, frames out, time as argument.
class Drive {
 public:
  explicit Drive(const DriveConfig& config);

  /// Motion and watchdogs from the last call up to `now`; appends what the drive says by itself.
  void advance(Time now, std::vector<can::Frame>& out) {
    move(now, out);
    watch(now, out);
  }
  /// The two halves of `advance`: between them a physics world moves the joint.
  void move(Time now, std::vector<can::Frame>& out);
  void watch(Time now, std::vector<can::Frame>& out);
  /// One frame from the bus; appends answers.
  void handle(const can::Frame& frame, Time now, std::vector<can::Frame>& out);
  void inject(Trouble trouble);

  /// Of the joint: the truth, or what a world's sensors say.
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
  void supervise(Time now, std::vector<can::Frame>& out);
  arm::QuickStop quick_stop() const;
  void update_objects();
  void on_nmt(const can::Frame& frame, std::vector<can::Frame>& out);
  void on_sdo(const can::Frame& frame, std::vector<can::Frame>& out);
  std::uint32_t download(const arm::Sdo& request);
  std::uint32_t check_mapping(const arm::Sdo& request) const;
  void on_rpdo(const can::Frame& frame, Time now);
  void on_sync(std::vector<can::Frame>& out);
  void obey(std::uint16_t controlword);
  void fail(std::uint16_t code, std::vector<can::Frame>& out);
  void connection_lost(std::uint16_t code, std::vector<can::Frame>& out);
  double period_s() const;
  double deceleration() const;

  DriveConfig config_;
  std::variant<AxisPlant, WorldJoint> joint_;
  Dictionary objects_;
  arm::NmtState nmt_ = arm::NmtState::boot_up;
  DriveState state_ = DriveState::switch_on_disabled;
  std::uint16_t controlword_ = 0;                  // obeyed last
  double reference_ = 0.0, reference_rate_ = 0.0;  // interpolated set-point [rad], [rad/s]
  double interpolation_left_s_ = 0.0;
  double lag_s_ = 0.0;    // how long the following error is too large
  double moved_s_ = 0.0;  // in the last move
  Time now_{};
  bool started_ = false, mute_ = false;
  std::optional<Trouble> trouble_;
  std::optional<Time> heartbeat_due_, master_seen_, rpdo_seen_;
};

}  // namespace mimesis::hw::sim
