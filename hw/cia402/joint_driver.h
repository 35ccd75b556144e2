#pragma once
#include <memory>
#include <string>
#include <vector>

#include "hw/actuators.h"
#include "hw/can/bus.h"
#include "hw/cia402/axis_master.h"
#include "hw/setpoint_limiter.h"

namespace mimesis::hw::cia402 {

struct JointDriverOptions {
  std::vector<Axis> axes{};  ///< one per joint, in the model's order
  /// names of the joints, for reasons; empty: A1, A2 ...
  std::vector<std::string> names{};
  JointLimits limits{};               ///< limits of the model; enforced on every set-point
  double rate_hz = 200.0;             ///< rate of read and write
  double boot_timeout_s = 2.0;        ///< until missing drives are reported
  double transition_timeout_s = 0.5;  ///< per change of a drive's state
  double feedback_timeout_s = 0.1;    ///< without TPDO: the axis is lost, also if all are silent
  /// that others answered, in a row, or one more among the last 20: the axis is lost; below 20
  int missed_syncs = 2;
  double following_window_rad = 0.0;  ///< 6065h of the drives; 0: their own
  double following_time_s = 0.0;      ///< 6066h of the drives; 0: their own
  /// largest distance of a joint from its set-point, beyond what its speed explains; 0: any
  double tracking_window_rad = 0.0;
  bool readonly = false;       ///< listens, never sends
  bool exclusive = false;      ///< nobody else's node is on this bus: NMT to all of them is allowed
  double sdo_timeout_s = 0.1;  ///< of each answer of a drive's configuration, three times
  /// reaction of the drives, also to their own watchdogs
  QuickStop quick_stop = QuickStop::disables;
};

/// CiA 402 drives on one CAN bus as the joints of an arm, or some joints of a robot. Per cycle one
/// batch of frames out (set-points, then SYNC) and one in. The first is a quick stop, after 0.15 s
/// of listening: on a bus that another master runs nothing is sent. Nodes that are not ours are
/// neither reset, started nor stopped. After any fault all axes get a quick stop; a set-point is
/// obeyed again only after Mode::idle, and starts at the actual posture.
class JointDriver final : public PhasedActuators {
 public:
  /// @throws ConfigError if the rate gives no interpolation period
  JointDriver(JointDriverOptions options, std::unique_ptr<can::Bus> bus);

  const Reading& read(Time now) override;
  void write(Time now, const Setpoint& setpoint) override;
  void stop() noexcept override;
  std::string reset_faults() override;

  /// What the drives cannot do, a line each; see AxisMaster.
  std::vector<std::string> notes() const;
  const Traffic& counters() const { return bus_->counters(); }

 private:
  void receive();
  void meet_master(const char* sign);
  void tell_all(Nmt command);
  void set_up();
  void supervise();
  void audit();
  void count_answers();
  void supervise_tracking();
  void supervise_following(std::size_t i);
  void supervise_axis(AxisMaster& axis);
  void halt();
  void end_halt();
  void publish();
  void lose(AxisMaster& axis, const std::string& why);
  double velocity_of(std::size_t i) const;
  void command_axes();
  void enable(AxisMaster& axis);
  void send_setpoints();
  bool stopped(const AxisMaster& axis) const;
  Phase rest() const;
  bool stays_powered() const { return options_.quick_stop == QuickStop::stays_powered; }

  JointDriverOptions options_;
  std::unique_ptr<can::Bus> bus_;
  std::vector<AxisMaster> axes_;
  std::vector<can::Frame> inbox_, outbox_;
  std::vector<int> axis_of_node_;
  std::vector<double> posture_;
  std::vector<int> astray_;  // measurements in a row, by axis

  /// Since when an axis has not done as it was told; nothing: it does.
  struct Following {
    std::optional<Time> denies{}, deviates{}, stands{};
    double stood_at = 0.0, asked_from = 0.0;  // its position, and the set-point then [rad]
  };
  std::vector<Following> following_;

  Time heartbeat_due_{}, audit_due_{};
  std::size_t audit_ = 0;    // the axis that was asked last
  Time silent_until_{};      // after bus-off
  Time halted_until_{};      // after a drive was lost in motion
  Time retry_at_{};          // after a failed set-up
  Time reset_until_{};       // drives in fault are reset until then
  bool begun_ = false;       // first cycle seen
  bool synced_ = false;      // the last SYNC went to the wire
  bool configured_ = false;  // every drive is configured and started
  bool ours_ = false;        // was once: these drives are not left without a stop
};

/// The joints of one robot on several buses: an JointDriver each, its joints after those of the one
/// before. All start to follow together, and what stops one bus stops all.
class GroupDriver final : public Actuators {
 public:
  /// Precondition: at least one.
  explicit GroupDriver(std::vector<std::unique_ptr<JointDriver>> parts);

  const Reading& read(Time now) override;
  void write(Time now, const Setpoint& setpoint) override;
  void stop() noexcept override;
  std::string reset_faults() override;

  Traffic traffic() const override;  ///< frames on all buses together

 private:
  void combine();
  bool any(Phase phase) const;
  Mode mode_of(const Reading& part, Mode asked, bool ready) const;

  std::vector<std::unique_ptr<JointDriver>> parts_;
  std::vector<const Reading*> readings_;  // readings of the parts
  std::vector<Mode> modes_;               // modes of this cycle
  std::size_t speaker_ = 0;               // the part whose reason is ours
  std::uint64_t limited_ = 0;             // sum of the parts
  Reading reading_;
};

}  // namespace mimesis::hw::cia402
