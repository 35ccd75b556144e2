#pragma once
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hw/actuators.h"
#include "hw/arm/cia402.h"
#include "hw/arm/drive_setup.h"

namespace mimesis::hw::arm {

/// Our side of one drive: finds it, configures it by SDO (one access per cycle), takes in what it
/// says. Pure: frames in, frames out, time as argument.
class AxisMaster {
 public:
  /// @param name "A3 (node 3)", for reasons
  AxisMaster(std::string name, const Axis& axis, std::vector<SetupStep> steps);

  /// Forgets the drive: it is searched and configured again.
  void restart();
  /// A frame of this node.
  void handle(const Identity& id, const can::Frame& frame, Time now);
  /// Appends the SDO request that is due.
  void advance(Time now, std::vector<can::Frame>& out);
  /// Supervision starts here: the drive is to answer from now on.
  void watch_from(Time now) { feedback_seen_ = heartbeat_seen_ = now; }

  bool found() const { return step_ > 0; }
  bool configured() const { return step_ == steps_.size(); }
  /// Empty, or why the configuration cannot go on.
  const std::string& failure() const { return failure_; }
  /// True once if the drive has rebooted since it was configured.
  bool take_rebooted() { return std::exchange(rebooted_, false); }

  bool heard() const { return heard_; }  ///< feedback has come since the start
  Time feedback_age(Time now) const { return now - feedback_seen_; }
  Time heartbeat_age(Time now) const { return now - heartbeat_seen_; }
  const JointReading& reading() const { return reading_; }
  /// Where the drive holds its motor, if it tells; else where the joint is [rad].
  double demand_rad() const { return demand_rad_.value_or(reading_.position_rad); }
  /// The drive still moves that, as on a quick stop's ramp.
  bool demand_moves() const { return demand_moves_; }
  /// How long the drive has shown its present state.
  Time state_age(Time now) const { return now - state_since_; }
  /// "A3 (node 3): expected operation enabled, is fault (statusword 0x0218): following error
  /// (0x8611)"
  std::string complaint(DriveState expected) const;

  const std::string& name() const { return name_; }
  const Axis& axis() const { return axis_; }

  // What we tell the drive; kept here because a fault reset is an edge.
  std::uint16_t controlword = 0;
  double target_rad = 0.0;

 private:
  void on_response(const Sdo& response);
  void fail(const std::string& why);
  void next_step();
  bool uploading() const;

  std::string name_;
  Axis axis_;
  std::vector<SetupStep> steps_;
  std::size_t step_ = 0;
  bool verifying_ = false;  // second half of write_checked
  std::optional<Time> asked_;
  int attempts_ = 0;
  std::string failure_;

  JointReading reading_;
  std::optional<double> demand_rad_;
  bool demand_moves_ = false;
  std::uint16_t statusword_ = 0;
  std::uint16_t emergency_ = 0;
  bool heard_ = false, rebooted_ = false;
  Time feedback_seen_{}, heartbeat_seen_{}, state_since_{};
};

}  // namespace mimesis::hw::arm
