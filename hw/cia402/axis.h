#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hw/actuators.h"
#include "hw/cia402/canopen.h"
#include "hw/cia402/cia402.h"

namespace mimesis::hw::cia402 {

/// Relation between a joint of the robot's model and its drive on the bus. `visit` lets the bridge
/// and the simulated drives read the same table.
struct Axis {
  int node_id = 0;                        ///< CANopen node, 1..126 [1]
  double increments_per_rad = 160'000.0;  ///< encoder increments × gear ratio / 2π [1/rad]
  int sign = 1;                     ///< +1, or -1 if the drive turns against the model's axis [1]
  double rated_torque_n_m = 100.0;  ///< at the joint; 6077h is in thousandths of it [N m]

  template <class Visitor>
  void visit(Visitor& v) {
    v("node_id", node_id, 1, 126);
    v("increments_per_rad", increments_per_rad, 100.0, 1e8);
    v("sign", sign, -1, 1);
    v("rated_torque_n_m", rated_torque_n_m, 0.1, 1e4);
  }

  std::int32_t to_increments(double rad) const;  ///< also for rad/s, rad/s²; saturates
  double to_rad(std::int32_t increments) const { return sign * increments / increments_per_rad; }
  double to_torque(std::int32_t thousandths) const {
    return sign * thousandths * 1e-3 * rated_torque_n_m;
  }
};

/// `axes` checked, or nodes 1..`joints` with defaults if it is empty.
/// @throws ConfigError naming the axis: wrong number, node id used twice, sign 0
std::vector<Axis> complete(std::vector<Axis> axes, int joints);

inline constexpr int kMasterNode = 127;                ///< node id of our heartbeat
inline constexpr int kMasterHeartbeatMs = 100;         ///< we send
inline constexpr int kMasterHeartbeatTimeoutMs = 250;  ///< drives stop after
inline constexpr int kDriveHeartbeatMs = 100;          ///< drives send
inline constexpr int kDriveHeartbeatTimeoutMs = 250;   ///< we stop after
inline constexpr int kRpdoDeadlineMs = 100;            ///< drives stop without set-points after

/// One SDO access of the configuration of a drive.
struct SetupStep {
  enum class Kind : std::uint8_t {
    expect,         ///< upload; value under `mask` must be equal
    expect_least,   ///< upload; value must be at least as large
    write,          ///< download
    write_checked,  ///< download, then upload: the drive must have kept it
  };
  Kind kind;
  Object object;
  std::uint32_t value;
  int bytes;
  const char* meaning;
  std::uint32_t mask = 0xFFFFFFFF;
};

/// Interpolation period 60C2h: value · 10^exponent seconds.
struct Period {
  std::uint8_t value;
  std::int8_t exponent;
};
/// @throws ConfigError if 1/rate is no whole number of 0.1 ms up to 255
Period period_of(double rate_hz);

/// Setup of a drive: follow positions synchronously, and stop if the bridge is lost.
/// Afterwards:
///   RPDO1 controlword 6040h (2 B), target position 607Ah (4 B), taken with SYNC
///   TPDO1 statusword 6041h (2 B), position 6064h (4 B), torque 6077h (2 B), sent on SYNC
///   TPDO2 velocity 606Ch (4 B), sent on SYNC; of a drive that stays powered also its position
///         demand 6062h (4 B): a loaded joint does not stand where its motor is held
/// @param q_min,q_max [rad], v_max [rad/s], a_max [rad/s²]: limits of the joint
std::vector<SetupStep> setup_steps(const Axis& axis, double q_min, double q_max, double v_max,
                                   double a_max, Period period,
                                   QuickStop quick_stop = QuickStop::disables);

/// Our side of one drive: finds it, configures it by SDO (one access per cycle), reads its
/// messages. Pure: frames in, frames out, time as argument.
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
  /// Empty, or the reason why the configuration cannot continue.
  const std::string& failure() const { return failure_; }
  /// True once if the drive has rebooted since it was configured.
  bool take_rebooted() { return std::exchange(rebooted_, false); }

  bool heard() const { return heard_; }  ///< feedback has come since the start
  Time feedback_age(Time now) const { return now - feedback_seen_; }
  Time heartbeat_age(Time now) const { return now - heartbeat_seen_; }
  const JointReading& reading() const { return reading_; }
  /// Position at which the drive holds its motor, if reported; else the joint's [rad].
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

  // controlword of the next frame; kept here because a fault reset is an edge
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

}  // namespace mimesis::hw::cia402
