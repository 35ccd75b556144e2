#pragma once
#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace mimesis::hw {

/// Graph time [ns]; all of hw is driven by it and reads no clock.
using Time = std::chrono::nanoseconds;

/// State of one drive [IEC 61800-7-201 = CiA 402, power drive system state machine].
enum class DriveState : std::uint8_t {
  unknown = 0,
  not_ready_to_switch_on = 1,
  switch_on_disabled = 2,
  ready_to_switch_on = 3,
  switched_on = 4,
  operation_enabled = 5,
  quick_stop_active = 6,
  fault_reaction_active = 7,
  fault = 8,
};

const char* name(DriveState state);

/// One joint, in the units, order and signs of the robot's model.
struct JointReading {
  double position_rad = 0.0;
  double velocity_rad_s = 0.0;
  double torque_n_m = 0.0;
  DriveState drive = DriveState::unknown;
  std::uint16_t statusword = 0;  ///< 6041h, of drives that have one
};

/// "operation enabled (statusword 0x0237)"
std::string text(const JointReading& joint);

/// Where the actuators as a whole are.
enum class Phase : std::uint8_t {
  starting,   ///< searching and configuring; postures may be old
  idle,       ///< reachable, not powered
  enabling,   ///< on the way to following
  following,  ///< every drive is enabled and follows
  stopping,   ///< quick stop
  fault,      ///< quick stop, or no longer reachable, because of `reason`
  holding,    ///< not following, but powered: stopped by a quick stop that keeps the posture
};

const char* name(Phase phase);

struct Reading {
  Phase phase = Phase::starting;
  bool posture_known = false;  ///< every joint has reported since the start
  std::vector<JointReading> joints;
  /// reason of starting and fault: one line with axis, expected and actual state
  std::string reason;
  /// which input demands an emergency stop now; empty: none does
  std::string emergency{};
  std::uint64_t limited = 0;  ///< cycles in which a set-point was changed to respect a limit
};

/// Frames, packets or registers exchanged with the actuators since the start.
struct Traffic {
  std::uint64_t sent = 0, received = 0;
  std::uint64_t errors = 0;  ///< not sent, or reported by the medium
};

/// Task of the actuators from now on.
enum class Mode : std::uint8_t {
  idle,    ///< quick stop; afterwards no power, or the posture is kept (the robot's kind decides)
  follow,  ///< track `position_rad`; from rest or fault: enable, starting at the actual posture
  hold,    ///< come to rest by bounded deceleration and stay there, powered
};

struct Setpoint {
  Mode mode = Mode::idle;
  std::span<const double> position_rad{};  ///< targets of Mode::follow, one per joint
  int missed = 0;  ///< cycles left out before this one, in which the drives went on at their rate
  bool brakes = false;  ///< the targets stop the robot: at once, whatever the limit of the jerk
};

/// Interface between the bridge and the actuators. Per cycle: read, write. Never blocks.
class Actuators {
 public:
  virtual ~Actuators() = default;
  /// Takes in what arrived up to `now`, advances the state machine.
  virtual const Reading& read(Time now) = 0;
  /// Sends the set-point of this cycle, limited to the robot's limits.
  virtual void write(Time now, const Setpoint& setpoint) = 0;
  /// Quick stop of all joints, at once; the first and the last thing sent. Nothing is sent after it
  /// until the next write.
  virtual void stop() noexcept = 0;
  /// Takes drives out of their faults; they stay disabled. Phase::fault ends as soon as all are.
  /// @return empty, or why there is nothing to reset
  virtual std::string reset_faults() { return "there is no fault"; }
  virtual Traffic traffic() const { return {}; }
};

}  // namespace mimesis::hw
