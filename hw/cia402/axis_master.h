#pragma once
#include <bit>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hw/actuators.h"
#include "hw/cia402/axis.h"
#include "hw/cia402/setup.h"

namespace mimesis::hw::cia402 {

/// Our side of one drive: finds it, configures it by SDO (one access per cycle), reads its
/// messages. What a drive refuses is handled by what it says: an object that may be missing becomes
/// a note, one that may not be written is read, PDOs that cannot be mapped anew are used as they
/// are. Pure: frames in, frames out, time as argument.
class AxisMaster {
 public:
  static constexpr int kLately = 20;  ///< cycles

  /// @param name "A3 (node 3)", for reasons
  /// @param sdo_timeout of each answer; three are missed before it counts
  AxisMaster(std::string name, const Axis& axis, std::vector<SetupStep> steps,
             Time sdo_timeout = std::chrono::milliseconds(100));

  /// Forgets the drive: it is searched and configured again.
  void restart();
  /// A frame of this node.
  void handle(const Identity& id, const can::Frame& frame, Time now);
  /// Appends the SDO request that is due.
  void advance(Time now, std::vector<can::Frame>& out);
  /// Supervision starts here: the drive is to answer from now on.
  void watch_from(Time now) {
    feedback_seen_ = heartbeat_seen_ = now;
    misses_ = 0;
  }

  /// Appends the request of node guarding to a configured drive that is watched so.
  void guard(std::vector<can::Frame>& out) const;

  /// Precondition: configured(). Appends a request for the next object that stops the drive when
  /// its master is lost or it does not follow: another program on the bus may change it.
  void audit(std::vector<can::Frame>& out);
  /// Which of them was changed: "SDO 6065:00 (largest following error): expected 0x1F40, is
  /// 0x0000"; empty: none.
  const std::string& changed() const { return changed_; }

  bool found() const { return step_ > 0; }
  bool configured() const { return step_ == steps_.size() && failure_.empty(); }
  /// Empty, or the reason why the configuration cannot continue.
  const std::string& failure() const { return failure_; }
  /// Restrictions that the drive imposes, a line each: "A2 (node 5): 1400:05: sub-index does not
  /// exist (0x06090011): ...".
  const std::vector<std::string>& notes() const { return notes_; }
  /// True once if the drive has rebooted since it was configured.
  bool take_rebooted() { return std::exchange(rebooted_, false); }

  /// The drive has shown its mode of operation; some show it only while they are enabled.
  bool mode_shown() const { return mode_shown_; }
  /// Appends a request for it, now and then. "A3 (node 3): SDO 6061:00 ..: expected .., is ..": why
  /// it cannot follow.
  void ask_mode(std::vector<can::Frame>& out);
  std::string wrong_mode() const;
  /// One controlword of those that lead out of a fault: the bit is held for 0.1 s, since some
  /// drives look for it slowly, and lowered for a cycle, since its edge counts.
  void reset_fault(Time now);

  bool heard() const { return heard_; }  ///< feedback has come since the start
  /// Ends a cycle whose SYNC was on the wire: it counts as missed if this drive has sent no
  /// feedback since the last, though `others` have; not at all if nobody has.
  void end_cycle(bool others) {
    if (answered_ || others) misses_ = misses_ << 1 | (answered_ || !on_sync_ ? 0 : 1);
    answered_ = false;
  }
  bool answered() const { return answered_; }              ///< feedback has come in this cycle
  int missed() const { return std::countr_one(misses_); }  ///< cycles in a row
  int missed_lately() const { return std::popcount(misses_ & ((1u << kLately) - 1)); }
  bool stop_open() const { return stop_open_; }  ///< its input of an emergency stop
  Time feedback_age(Time now) const { return now - feedback_seen_; }
  /// 0 of a drive without one.
  Time heartbeat_age(Time now) const { return beats_ ? now - heartbeat_seen_ : Time(0); }
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

  /// RPDO1: controlword and the target of the mode as the drive has mapped them.
  can::Frame command() const;

  /// Its set-points are velocities.
  bool by_velocity() const {
    return mode_ == static_cast<int>(OperationMode::cyclic_velocity) ||
           mode_ == static_cast<int>(OperationMode::profile_velocity);
  }
  /// Bit 12 of its statusword says whether it follows. [CiA 402-2, cyclic synchronous modes]
  bool tells_following() const { return mode_ >= static_cast<int>(OperationMode::cyclic_position); }

  const std::string& name() const { return name_; }
  const Axis& axis() const { return axis_; }

  // controlword of the next frame; kept here because a fault reset is an edge
  std::uint16_t controlword = 0;
  double target_rad = 0.0;    ///< of position modes
  double target_rad_s = 0.0;  ///< of velocity modes
  double target_n_m = 0.0;    ///< of cyclic torque

 private:
  std::int32_t commanded(Object object) const;
  void on_response(const Sdo& response);
  void on_refusal(const SetupStep& step, std::uint32_t code);
  void on_learnt(const SetupStep& step, std::uint32_t value);
  void learn_mapping(const SetupStep& refused, std::uint32_t code);
  void check_maps();
  void note(const SetupStep& step, std::uint32_t code, const std::string& consequence);
  std::string way_on(const SetupStep& step) const;
  void on_mode(std::uint32_t shown);
  void take_in(const std::vector<Mapped>& map, const can::Frame& frame, Time now);
  void fail(const std::string& why);
  void next_step();
  bool uploading() const;

  /// An object that is read again while the drive runs.
  struct Audited {
    SetupStep step;
    bool known = true;  ///< else the first answer tells how it shall be
  };
  void on_audit(const Sdo& response);

  std::string name_;
  Axis axis_;
  const std::vector<SetupStep> wanted_;
  const Time sdo_timeout_;
  std::int32_t mode_ = 0;  // 6060h
  SetupStep mode_step_{};  // that reads 6061h
  bool mode_shown_ = false;
  std::uint32_t shown_mode_ = 0;  // last
  int mode_reads_ = 0;
  bool beats_ = true, watches_ = true, deadline_ = true;  // heartbeats both ways, 1400:05
  std::optional<bool> toggle_;                            // of the last answer to guarding
  bool alternates_ = false;                               // it has changed
  Time raised_at_{};                                      // of the fault reset
  std::vector<SetupStep> steps_;  // the wanted ones, changed by what the drive refuses
  std::size_t step_ = 0;
  bool verifying_ = false;     // second half of write_checked
  std::uint32_t refused_ = 0;  // abort code of a write whose object is now read
  std::optional<Time> asked_;
  std::vector<Audited> audited_;
  std::size_t audit_ = 0;  // the one that was asked for last
  std::string changed_;
  int attempts_ = 0;
  std::string failure_;
  std::vector<std::string> notes_;
  PdoMaps maps_;

  JointReading reading_;
  std::optional<double> demand_rad_;
  bool demand_moves_ = false;
  std::uint16_t emergency_ = 0;
  bool heard_ = false, rebooted_ = false, answered_ = false;
  bool on_sync_ = true;  // its feedback is mapped by us
  bool stop_known_ = false, stop_open_ = false;
  std::uint32_t misses_ = 0;  // a bit per cycle, the last one is bit 0
  bool position_known_ = false, shows_velocity_ = true;
  Time feedback_seen_{}, heartbeat_seen_{}, state_since_{}, position_seen_{};
};

}  // namespace mimesis::hw::cia402
