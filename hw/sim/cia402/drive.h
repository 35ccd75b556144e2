#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "hw/can/bus.h"
#include "hw/cia402/axis.h"
#include "hw/sim/cia402/habits.h"
#include "hw/sim/cia402/plant.h"
#include "hw/sim/cia402/slave.h"

namespace mimesis::hw::sim {

/// Trapezoidal motion in steps: never faster than `v_max`, and never faster than it can still stop
/// at the target with `deceleration`. Over a step T the largest such speed at distance d is
///   w = √((aT/2)² + 2a|d|) − aT/2.
struct Profile {
  double position = 0.0;  ///< [rad]
  double velocity = 0.0;  ///< [rad/s]

  void towards(double target, double v_max, double acceleration, double deceleration, double dt) {
    const double distance = target - position, half = 0.5 * deceleration * dt;
    const double stoppable =
        std::sqrt(half * half + 2.0 * deceleration * std::abs(distance)) - half;
    const double wanted = std::copysign(std::min(v_max, stoppable), distance);
    change(wanted, acceleration, deceleration, dt);
    if (std::abs(distance) <= std::abs(velocity) * dt && std::abs(velocity) <= deceleration * dt) {
      position = target;
      velocity = 0.0;
    } else {
      position += velocity * dt;
    }
  }
  /// Velocity towards `wanted`, with the deceleration where it becomes slower; the caller moves.
  void change(double wanted, double acceleration, double deceleration, double dt) {
    const bool slower = velocity * (wanted - velocity) < 0.0;
    const double step = (slower ? deceleration : acceleration) * dt;
    velocity += std::clamp(wanted - velocity, -step, step);
  }
};

/// Faults of a drive. Numbers are those of object 2F00h:01.
enum class Trouble : std::uint8_t {
  overcurrent = 1,       ///< the drive finds an error: fault
  mute = 2,              ///< its bus cable is cut: it neither receives nor sends
  jam = 3,               ///< the joint meets an obstacle: following error
  over_temperature = 4,  ///< fault
  power = 5,             ///< no supply: the brake falls, everything is forgotten
  stall = 6,             ///< the program hangs: no answer, no motion, no watchdogs
  bus_off = 7,           ///< its CAN controller leaves the bus, which the drive notices
  emergency_stop = 8,    ///< the circuit at its input (60FDh, bit 3, interlock) is open
};
inline constexpr std::int64_t kTroubles = 8;

struct DriveConfig {
  cia402::Axis axis{};
  PlantParams plant{};
  bool in_a_world = false;             ///< a physics world moves the joint: Drive::world_joint
  double home_rad = 0.0;               ///< position at power-on
  int extrapolated_cycles = 0;         ///< without a set-point it goes on at its rate for so long
  double following_window_rad = 0.05;  ///< default of 6065h
  double following_time_s = 0.05;      ///< default of 6066h
  std::vector<Address> lacks{};        ///< objects that this maker has left out
  std::vector<Address> fixed{};        ///< objects that this maker lets nobody write
  std::map<Address, std::int64_t> made{};  ///< values that this maker has given
  SlaveHabits slave{};
  DriveHabits habits{};
  /// Where the limit switches are [rad]; infinite: none.
  double switch_low_rad = -std::numeric_limits<double>::infinity();
  double switch_high_rad = std::numeric_limits<double>::infinity();
};

/// A drive [CiA 402-2] on a CANopen slave, from the tables of the standard. Modes of operation:
/// profile position 1 and velocity 3, homing 6 (methods 17, 18, 35, 37), cyclic synchronous
/// position 8, velocity 9 and torque 10. Its increments, signs and words are computed here, not by
/// the code of the bridge that it is to test. Pure: frames in, frames out, time as argument.
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
  /// @param duration 0: for ever
  void inject(Trouble trouble, Time duration = {});

  /// State of the joint: the truth, or readings of a world's sensors.
  double position_rad() const;
  double velocity_rad_s() const;
  double torque_n_m() const;
  DriveState state() const { return state_; }
  const Dictionary& objects() const { return slave_.objects; }
  /// Precondition: DriveConfig::in_a_world.
  WorldJoint& world_joint() { return std::get<WorldJoint>(joint_); }
  const WorldJoint& world_joint() const { return std::get<WorldJoint>(joint_); }

 private:
  using Frames = std::vector<can::Frame>;
  template <class What>
  auto joint(const What& what) {
    return std::visit(what, joint_);
  }

  void add_objects();
  void react(Event event, Frames& out);
  void reset();
  void obey(Frames& out);
  bool command(std::uint16_t word, bool reset_edge);
  void begin_operation();
  void take_targets(std::uint16_t word);
  void move_joint(double dt);
  void follow_cyclic(double dt);
  void follow_profile(double dt);
  void home(double dt);
  void finish_homing();
  void brake(Address ramp, double dt);
  void lose_connection();
  void fail(std::uint16_t code, std::uint8_t error_bits, Frames& out);
  void end_trouble(Frames& out);
  void update_objects();
  std::uint16_t statusword() const;
  void show_mode();
  bool resets(bool edge, std::uint16_t word);

  std::int64_t value(Address address) const { return slave_.objects.value(address); }
  std::int64_t counts(double rad) const;
  double radians(std::int64_t counts) const;
  double rate_rad(Address address) const;  ///< magnitude of a rate or acceleration
  double held() const;
  bool at_rest() const;
  bool in_position_mode() const;
  bool switch_pressed(int end) const;
  double period_s() const;

  DriveConfig config_;
  std::variant<AxisPlant, WorldJoint> joint_;
  Slave slave_;
  DriveState state_ = DriveState::switch_on_disabled;
  std::uint16_t controlword_ = 0;                  // obeyed last
  double zero_rad_;                                // where the encoder counts 0
  double reference_ = 0.0, reference_rate_ = 0.0;  // set-point [rad], [rad/s]
  double moves_on_s_ = 0.0;                        // how long the reference still moves
  Profile profile_;
  double goal_rad_ = 0.0;           // of profile position
  std::optional<double> next_rad_;  // set-point that waits for the present one
  bool acknowledged_ = false;       // statusword bit 12 of profile position
  enum class Homing : std::uint8_t { off, seeking, leaving, attained, error } homing_{};
  std::optional<Time> mode_due_;  // 6061h follows then
  std::optional<Time> reset_since_, switch_on_since_;
  Time emergency_due_{};
  double lag_s_ = 0.0;    // how long the following error is too large
  double moved_s_ = 0.0;  // in the last move
  Time now_{};            // of the last move
  Time own_time_{};       // sum of all moves, of heartbeat and watchdogs: never goes back
  bool started_ = false;
  std::optional<Trouble> next_trouble_;  // begins with the next advance
  std::optional<Trouble> trouble_;       // that lasts
  std::optional<Time> trouble_ends_;
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
  const Traffic& counters() const { return bus_->counters(); }

 private:
  void receive();
  void answer(std::span<const can::Frame> frames);

  std::unique_ptr<can::Bus> bus_;
  std::vector<Drive> drives_;
  std::optional<Time> stepped_;
  std::vector<can::Frame> inbox_, outbox_;
};

}  // namespace mimesis::hw::sim
