#include "hw/sim/cia402/drive.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/time.h"

namespace mimesis::hw::sim {

namespace {

using can::Frame;
using std::chrono::milliseconds;
using enum Type;
using enum Access;

constexpr double kMostCounts = 0x7FFFFFFF;

enum ModeOfOperation : std::int64_t {
  kProfilePosition = 1,
  kProfileVelocity = 3,
  kHoming = 6,
  kCyclicPosition = 8,
  kCyclicVelocity = 9,
  kCyclicTorque = 10
};

/// A row of the state machine [CiA 402-2, tables of commands and transitions]: with these bits of
/// the controlword under the mask, `from` becomes `to`.
struct Transition {
  DriveState from;
  unsigned mask, bits;
  DriveState to;
};
using enum DriveState;
constexpr std::array kTransitions = {
    Transition{switch_on_disabled, 0x87, 0x06, ready_to_switch_on},  // 2 shutdown
    Transition{ready_to_switch_on, 0x82, 0x00, switch_on_disabled},  // 7 disable voltage
    Transition{ready_to_switch_on, 0x86, 0x02, switch_on_disabled},  // 7 quick stop
    Transition{ready_to_switch_on, 0x87, 0x07, switched_on},         // 3 switch on
    Transition{switched_on, 0x82, 0x00, switch_on_disabled},         // 10
    Transition{switched_on, 0x86, 0x02, switch_on_disabled},         // 10
    Transition{switched_on, 0x87, 0x06, ready_to_switch_on},         // 6
    Transition{switched_on, 0x8F, 0x0F, operation_enabled},          // 4 enable operation
    Transition{operation_enabled, 0x82, 0x00, switch_on_disabled},   // 9
    Transition{operation_enabled, 0x86, 0x02, quick_stop_active},    // 11
    Transition{operation_enabled, 0x87, 0x06, ready_to_switch_on},   // 8
    Transition{operation_enabled, 0x8F, 0x07, switched_on},          // 5 disable operation
    Transition{quick_stop_active, 0x82, 0x00, switch_on_disabled},   // 12
    Transition{quick_stop_active, 0x8F, 0x0F, operation_enabled},    // 16, see stays_powered()
};

/// Statusword of each state, in the order of DriveState; voltage and remote (0210h) are added.
constexpr std::array<unsigned, 9> kStatuswords = {0x00, 0x00, 0x40, 0x21, 0x23,
                                                  0x27, 0x07, 0x0F, 0x08};

bool stays_powered(std::int64_t quick_stop_option) { return quick_stop_option >= 5; }

bool silences(Trouble t) {
  return t == Trouble::mute || t == Trouble::power || t == Trouble::stall || t == Trouble::bus_off;
}

}  // namespace

Drive::Drive(const DriveConfig& config)
    : config_(config),
      joint_(AxisPlant(config.plant, config.home_rad)),
      slave_(config.axis.node_id, "mimesis simulated drive", 0x00020192,  // servo, profile 402
             config.slave),
      zero_rad_(config.axis.offset_rad) {
  if (config_.in_a_world) joint_ = WorldJoint(config_.home_rad);
  add_objects();
  for (const Address lacking : config_.lacks) slave_.objects.remove(lacking);
  const auto change = [&](Address address, const auto& how) {
    const Entry* found = slave_.objects.find(address);
    if (found == nullptr) return;
    Entry entry = *found;
    how(entry);
    slave_.objects.add(entry);
  };
  for (const Address address : config_.fixed) change(address, [](Entry& e) { e.access = ro; });
  for (const auto& made : config_.made)
    change(made.first, [&](Entry& e) { e.value = made.second; });
  if (config_.habits.boots_in_fault) state_ = fault;
  update_objects();
}

void Drive::add_objects() {
  using enum Carried;
  const auto magnitude = [&](double rad) {
    return std::abs(static_cast<std::int64_t>(std::round(rad * config_.axis.increments_per_rad)));
  };
  const std::int64_t v_max = magnitude(config_.plant.v_max_rad_s),
                     a_max = magnitude(config_.plant.a_max_rad_s2);
  std::vector<std::int64_t> modes{kCyclicPosition,  0,       kProfilePosition,
                                  kProfileVelocity, kHoming, kCyclicVelocity};
  if (!config_.in_a_world) modes.push_back(kCyclicTorque);
  std::int64_t supported = 0;
  for (const std::int64_t mode : modes) supported |= mode > 0 ? std::int64_t{1} << (mode - 1) : 0;
  std::vector<std::int64_t> homing{35, 37};
  const int sign = config_.axis.sign;
  if (std::isfinite(config_.switch_low_rad)) homing.push_back(sign > 0 ? 17 : 18);
  if (std::isfinite(config_.switch_high_rad)) homing.push_back(sign > 0 ? 18 : 17);
  const auto at = [](Address address, Type type, Access access, Carried carried,
                     std::int64_t value = 0) {
    return Entry{
        .address = address, .type = type, .access = access, .carried = carried, .value = value};
  };
  const auto one_of = [&](Address address, Type type, std::vector<std::int64_t> choices) {
    Entry entry = at(address, type, rw, no, choices.front());
    entry.choices = std::move(choices);
    return entry;
  };
  Dictionary& o = slave_.objects;
  o.add({at(0x1600'00, u8, rw, no, 1), at(0x1600'01, u32, rw, no, 0x60400010),
         at(0x1A00'00, u8, rw, no, 1), at(0x1A00'01, u32, rw, no, 0x60410010)});
  o.add({one_of(0x6007'00, i16, {1, 0, 2, 3}), at(0x603F'00, u16, ro, tpdo),
         at(0x6040'00, u16, rw, rpdo), at(0x6041'00, u16, ro, tpdo),
         one_of(0x605A'00, i16, {2, 1, 5, 6}), one_of(0x605B'00, i16, {0}),
         one_of(0x605C'00, i16, {0}), one_of(0x605D'00, i16, {1}),
         one_of(0x605E'00, i16, {2, 0, 1})});
  Entry mode = one_of(0x6060'00, i8, modes);
  mode.carried = rpdo;
  o.add({mode,
         at(0x6061'00, i8, ro, tpdo),
         at(0x6062'00, i32, ro, tpdo),
         at(0x6064'00, i32, ro, tpdo),
         at(0x6065'00, u32, rw, no, magnitude(config_.following_window_rad)),
         at(0x6066'00, u16, rw, no, static_cast<std::int64_t>(1e3 * config_.following_time_s)),
         at(0x6067'00, u32, rw, no, magnitude(1e-3)),
         at(0x606C'00, i32, ro, tpdo),
         at(0x6071'00, i16, rw, rpdo),
         at(0x6072'00, u16, rw, rpdo, 3000),
         at(0x6076'00, u32, ro, no, std::llround(1e3 * config_.axis.rated_torque_n_m)),
         at(0x6077'00, i16, ro, tpdo),
         at(0x607A'00, i32, rw, rpdo, counts(config_.home_rad)),
         at(0x607C'00, i32, rw, no),
         at(0x607D'00, u8, ro, no, 2),
         at(0x607D'01, i32, rw, no, -0x80000000LL),
         at(0x607D'02, i32, rw, no, 0x7FFFFFFF),
         at(0x607F'00, u32, ro, no, v_max),
         at(0x6081'00, u32, rw, rpdo, v_max / 4),
         at(0x6083'00, u32, rw, rpdo, a_max / 4),
         at(0x6084'00, u32, rw, rpdo, a_max / 4),
         at(0x6085'00, u32, rw, no, a_max),
         one_of(0x6098'00, i8, homing),
         at(0x6099'00, u8, ro, no, 2),
         at(0x6099'01, u32, rw, no, v_max / 10),
         at(0x6099'02, u32, rw, no, v_max / 40),
         at(0x609A'00, u32, rw, no, a_max / 4),
         at(0x60B1'00, i32, rw, rpdo),
         at(0x60B2'00, i16, rw, rpdo),
         at(0x60C2'00, u8, ro, no, 2),
         at(0x60F4'00, i32, ro, tpdo),
         at(0x60FD'00, u32, ro, tpdo),
         at(0x60FF'00, i32, rw, rpdo),
         at(0x6502'00, u32, ro, no, supported)});
  Entry period = at(0x60C2'01, u8, rw, no, 10), exponent = at(0x60C2'02, i8, rw, no, -3);
  period.low = 1;
  exponent.low = -6;
  exponent.high = 0;
  o.add({period, exponent});
  // This maker's own: faults on demand, temperature, a name that the user gives.
  Entry kind = at(0x2F00'01, u8, wo, no);
  kind.high = kTroubles;
  o.add({at(0x2F00'00, u8, ro, no, 2),
         kind,
         at(0x2F00'02, u16, rw, no),
         at(0x2F10'00, i16, ro, tpdo, 25),
         {.address = 0x2000'00, .type = text, .access = rw, .text = "axis"}});
}

void Drive::inject(Trouble trouble, Time duration) {
  if (silences(trouble) || trouble == Trouble::jam || trouble == Trouble::emergency_stop) {
    trouble_ = trouble;
    trouble_ends_.reset();
    if (duration > Time(0)) trouble_ends_ = now_ + duration;
    if (trouble == Trouble::jam) joint([](auto& j) { j.jam(true); });
    if (trouble == Trouble::power) state_ = switch_on_disabled;
    if (trouble == Trouble::bus_off) lose_connection();
  } else {
    next_trouble_ = trouble;  // reported with the next advance
  }
}

void Drive::end_trouble(Frames& out) {
  const Trouble ended = *trouble_;
  trouble_.reset();
  trouble_ends_.reset();
  if (ended == Trouble::jam) joint([](auto& j) { j.jam(false); });
  if (ended == Trouble::bus_off) slave_.emergency(0x8140, 0x10, out);
  if (ended != Trouble::power) return;
  slave_.objects.reset(0x2000'00, 0xFFFF'FF);
  reset();
  slave_.boot(out);
}

double Drive::position_rad() const {
  return std::visit([](const auto& joint) { return joint.position(); }, joint_);
}
double Drive::velocity_rad_s() const {
  return std::visit([](const auto& joint) { return joint.velocity(); }, joint_);
}
double Drive::torque_n_m() const {
  return std::visit([](const auto& joint) { return joint.torque(); }, joint_);
}
bool Drive::at_rest() const {
  return std::visit([](const auto& joint) { return joint.at_rest(); }, joint_);
}
double Drive::held() const {
  return std::visit([](const auto& joint) { return joint.held(); }, joint_);
}

std::int64_t Drive::counts(double rad) const {
  const cia402::Axis& a = config_.axis;
  return static_cast<std::int64_t>(
      std::clamp(std::round(a.sign * (rad - zero_rad_) * a.increments_per_rad), -kMostCounts - 1,
                 kMostCounts));
}
double Drive::radians(std::int64_t counts) const {
  const cia402::Axis& a = config_.axis;
  return static_cast<double>(a.sign * counts) / a.increments_per_rad + zero_rad_;
}
double Drive::rate_rad(Address address) const {
  return static_cast<double>(value(address)) / config_.axis.increments_per_rad;
}

bool Drive::in_position_mode() const {
  const std::int64_t mode = value(0x6061'00);
  return mode == kCyclicPosition || mode == kProfilePosition || mode == kHoming || mode == 0;
}

double Drive::period_s() const {
  constexpr double kOwn_s = 0.01;  // of a drive without 60C2h
  if (slave_.objects.find(0x60C2'01) == nullptr) return kOwn_s;
  return static_cast<double>(value(0x60C2'01)) * std::pow(10.0, static_cast<int>(value(0x60C2'02)));
}

/// On the ramp of an object; of a drive that lacks it as hard as the motor can.
void Drive::brake(Address ramp, double dt) {
  const double deceleration =
      slave_.objects.find(ramp) != nullptr ? rate_rad(ramp) : config_.plant.a_max_rad_s2;
  joint([&](auto& j) { j.brake(deceleration, dt); });
}

void Drive::move_joint(double dt) {
  switch (state_) {
    case operation_enabled:
      switch (value(0x6061'00)) {
        case kProfilePosition:
        case kProfileVelocity:
          return follow_profile(dt);
        case kHoming:
          return home(dt);
        default:
          return follow_cyclic(dt);
      }
    case quick_stop_active: {
      const std::int64_t option = value(0x605A'00);
      brake(option == 1 || option == 5 ? 0x6084'00 : 0x6085'00, dt);
      if (at_rest() && !stays_powered(option)) state_ = switch_on_disabled;
      return;
    }
    case fault_reaction_active:
      brake(value(0x605E'00) == 1 ? 0x6084'00 : 0x6085'00, dt);
      if (at_rest() || value(0x605E'00) == 0) state_ = fault;
      return;
    default:
      return joint([](auto& j) { j.lock(); });
  }
}

void Drive::follow_cyclic(double dt) {
  const cia402::Axis& a = config_.axis;
  if (config_.habits.ignores_targets || config_.habits.stands)
    return joint([](auto& j) { j.lock(); });
  switch (value(0x6061'00)) {
    case kCyclicVelocity: {
      const std::int64_t rate = value(0x60FF'00) + value(0x60B1'00);
      return joint(
          [&](auto& j) { j.turn(static_cast<double>(a.sign * rate) / a.increments_per_rad, dt); });
    }
    case kCyclicTorque: {
      const std::int64_t most = value(0x6072'00);
      const std::int64_t torque = std::clamp(value(0x6071'00) + value(0x60B2'00), -most, most);
      return joint([&](auto& j) {
        j.push(static_cast<double>(a.sign * torque) * 1e-3 * a.rated_torque_n_m, dt);
      });
    }
    default: {
      const double left = std::min(dt, moves_on_s_);
      const double rate = dt > 0.0 ? reference_rate_ * left / dt : 0.0;
      moves_on_s_ -= left;
      reference_ += reference_rate_ * left;
      joint([&](auto& j) { j.track(reference_, rate, dt); });
    }
  }
}

void Drive::follow_profile(double dt) {
  const double up = rate_rad(0x6083'00), down = rate_rad(0x6084'00);
  const bool halt = (controlword_ & 0x100) != 0;
  if (value(0x6061'00) == kProfileVelocity || halt) {
    const double wanted =
        static_cast<double>(config_.axis.sign * value(0x60FF'00)) / config_.axis.increments_per_rad;
    profile_.change(halt ? 0.0 : wanted, up, down, dt);
    profile_.position += profile_.velocity * dt;
  } else {
    profile_.towards(goal_rad_, rate_rad(0x6081'00), up, down, dt);
    if (next_rad_ && profile_.velocity == 0.0) {
      goal_rad_ = *next_rad_;
      next_rad_.reset();
      acknowledged_ = (controlword_ & 0x10) != 0;
    }
  }
  reference_ = profile_.position;
  joint([&](auto& j) { j.track(reference_, profile_.velocity, dt); });
}

/// Pressed switch at this end of the joint, -1 or 1.
bool Drive::switch_pressed(int end) const {
  return end < 0 ? position_rad() <= config_.switch_low_rad
                 : position_rad() >= config_.switch_high_rad;
}

/// Methods 17 and 18: towards the negative or positive limit switch, as the encoder counts, then
/// slowly back until it opens; that is home. 35 and 37: here.
void Drive::home(double dt) {
  const int end = value(0x6098'00) == 17 ? -config_.axis.sign : config_.axis.sign;
  double wanted = 0.0;
  if (homing_ == Homing::seeking) {
    if (switch_pressed(end)) homing_ = Homing::leaving;
    wanted = end * rate_rad(0x6099'01);
  }
  if (homing_ == Homing::leaving) {
    if (!switch_pressed(end) && end * profile_.velocity < 0.0) return finish_homing();
    wanted = -end * rate_rad(0x6099'02);
  }
  const double a = rate_rad(0x609A'00);
  profile_.change(wanted, a, a, dt);
  profile_.position += profile_.velocity * dt;
  reference_ = profile_.position;
  joint([&](auto& j) { j.track(reference_, profile_.velocity, dt); });
}

void Drive::finish_homing() {
  homing_ = Homing::attained;
  const cia402::Axis& a = config_.axis;
  zero_rad_ =
      position_rad() - static_cast<double>(a.sign * value(0x607C'00)) / a.increments_per_rad;
  profile_ = {held(), 0.0};
}

void Drive::fail(std::uint16_t code, std::uint8_t error_bits, Frames& out) {
  if (state_ == fault || state_ == fault_reaction_active) return;
  state_ = fault_reaction_active;
  slave_.objects.set(0x603F'00, code);
  slave_.emergency(code, error_bits, out);
}

/// Abort connection option 6007h: nothing, fault, disable voltage, quick stop.
void Drive::lose_connection() {
  if (state_ != operation_enabled) return;
  constexpr std::array kTo = {operation_enabled, fault_reaction_active, switch_on_disabled,
                              quick_stop_active};
  state_ = kTo.at(static_cast<std::size_t>(std::clamp<std::int64_t>(value(0x6007'00), 0, 3)));
}

void Drive::reset() {
  joint([](auto& j) { j.lock(); });
  state_ = config_.habits.boots_in_fault ? fault : switch_on_disabled;
  controlword_ = 0;
  homing_ = Homing::off;
}

void Drive::react(Event event, Frames& out) {
  switch (event) {
    case Event::lost:
      lose_connection();
      // Without PDOs there is no command.
      if (!slave_.operational() && state_ == operation_enabled) state_ = quick_stop_active;
      return;
    case Event::not_operational:
      if (state_ == operation_enabled) state_ = quick_stop_active;
      return;
    case Event::reset_node:
      return reset();
    case Event::set_points:
      return obey(out);
    case Event::sync:
      obey(out);
      update_objects();
      return slave_.send_synchronous(out);
    case Event::none:
      return;
  }
}

/// A fault reset is an edge; some drives look for it slowly, and some have a cause that stays.
bool Drive::resets(bool edge, std::uint16_t word) {
  if (config_.habits.keeps_fault) return false;
  if (!config_.habits.sticky_reset) return edge;
  if ((word & 0x80) == 0) reset_since_.reset();
  if (edge) reset_since_ = own_time_;
  return reset_since_ && own_time_ - *reset_since_ >= milliseconds(50);
}

bool Drive::command(std::uint16_t word, bool reset_edge) {
  if (state_ == fault) {
    if (!resets(reset_edge, word)) return false;
    state_ = switch_on_disabled;
    return true;
  }
  for (const Transition& t : kTransitions) {
    if (t.from != state_ || (word & t.mask) != t.bits) continue;
    if (t.from == quick_stop_active && t.to == operation_enabled &&
        !stays_powered(value(0x605A'00)))
      continue;
    if (t.to == switched_on && config_.habits.slow_switch_on) {
      if (!switch_on_since_) switch_on_since_ = own_time_;
      if (own_time_ - *switch_on_since_ < milliseconds(300)) return false;
    }
    switch_on_since_.reset();
    state_ = t.to;
    return true;
  }
  return false;
}

void Drive::show_mode() {
  const std::int64_t wanted = value(0x6060'00);
  const bool late = config_.habits.mode_shown_late && state_ != operation_enabled;
  if (config_.habits.mode_lag && wanted != value(0x6061'00)) {
    if (!mode_due_) mode_due_ = own_time_ + milliseconds(500);
    if (own_time_ < *mode_due_) return;
  }
  mode_due_.reset();
  slave_.objects.set(0x6061'00, late ? 0 : wanted);
}

void Drive::obey(Frames& out) {
  const auto word = static_cast<std::uint16_t>(value(0x6040'00));
  const DriveState before = state_;
  const std::uint16_t last = std::exchange(controlword_, word);
  const std::int64_t mode_before = value(0x6061'00);
  const bool switched = command(word, (word & ~last & 0x80) != 0);
  if (switched && before == ready_to_switch_on) command(word, false);  // 3 and 4 in one command
  if (before == fault && state_ != fault) {
    lag_s_ = 0.0;
    slave_.objects.set(0x603F'00, 0);
    slave_.clear_error(out);
  }
  if (state_ != operation_enabled) return;
  show_mode();
  if (before != operation_enabled || mode_before != value(0x6061'00)) begin_operation();
  if (before != operation_enabled) slave_.watch_set_points();
  take_targets(static_cast<std::uint16_t>(word & ~(before == operation_enabled ? last : 0)));
}

void Drive::begin_operation() {
  reference_ = goal_rad_ = held();
  profile_ = {held(), in_position_mode() ? 0.0 : velocity_rad_s()};
  next_rad_.reset();
  acknowledged_ = false;
  homing_ = Homing::off;
  lag_s_ = 0.0;
}

/// @param rising bits of the controlword that have become 1
void Drive::take_targets(std::uint16_t rising) {
  const auto limit = [&](Address address, double otherwise) {
    return slave_.objects.find(address) != nullptr ? value(address)
                                                   : static_cast<std::int64_t>(otherwise);
  };
  const std::int64_t low = limit(0x607D'01, -kMostCounts),
                     high = std::max(low, limit(0x607D'02, kMostCounts));
  switch (value(0x6061'00)) {
    case kProfilePosition: {
      if ((controlword_ & 0x10) == 0) acknowledged_ = acknowledged_ && next_rad_.has_value();
      if ((rising & 0x10) == 0 || acknowledged_) return;
      const bool relative = (controlword_ & 0x40) != 0;
      const std::int64_t target = value(0x607A'00) + (relative ? counts(goal_rad_) : 0);
      const double goal = radians(std::clamp(target, low, high));
      const bool moving = profile_.velocity != 0.0 || profile_.position != goal_rad_;
      if (moving && (controlword_ & 0x20) == 0) {
        next_rad_ = goal;
      } else {
        goal_rad_ = goal;
        next_rad_.reset();
      }
      acknowledged_ = true;
      return;
    }
    case kHoming: {
      if ((controlword_ & 0x10) == 0 && (homing_ == Homing::seeking || homing_ == Homing::leaving))
        homing_ = Homing::off;
      if ((rising & 0x10) == 0) return;
      profile_ = {held(), 0.0};
      homing_ = Homing::seeking;
      if (value(0x6098'00) >= 35)
        finish_homing();
      else if (value(0x6099'01) == 0 || value(0x6099'02) == 0)
        homing_ = Homing::error;
      return;
    }
    case kProfileVelocity:
    case kCyclicVelocity:
    case kCyclicTorque:
      return;
    default: {
      const double target = radians(std::clamp(value(0x607A'00), low, high));
      reference_rate_ = (target - reference_) / period_s();
      moves_on_s_ = (1 + config_.extrapolated_cycles) * period_s();
    }
  }
}

std::uint16_t Drive::statusword() const {
  unsigned word = kStatuswords.at(static_cast<std::size_t>(state_)) | 0x0210u;
  if (config_.habits.other_bits) word |= 0xC180u;
  const bool denies = config_.habits.no_bit12 || config_.habits.ignores_targets;
  if (state_ != operation_enabled) return static_cast<std::uint16_t>(word);
  const bool lags = lag_s_ > 0.0;
  switch (value(0x6061'00)) {
    case kProfilePosition: {
      const bool reached = profile_.velocity == 0.0 && !next_rad_ &&
                           std::abs(goal_rad_ - position_rad()) <= rate_rad(0x6067'00);
      word |= (reached ? 0x400u : 0u) | (acknowledged_ ? 0x1000u : 0u) | (lags ? 0x2000u : 0u);
      break;
    }
    case kProfileVelocity: {
      const std::int64_t wanted = config_.axis.sign * value(0x60FF'00);
      const double off =
          profile_.velocity - static_cast<double>(wanted) / config_.axis.increments_per_rad;
      word |= std::abs(off) < 1e-3 ? 0x400u : 0u;
      break;
    }
    case kHoming:
      if (homing_ == Homing::off) word |= 0x400u;  // interrupted or not started
      word |= homing_ == Homing::attained ? 0x1400u : homing_ == Homing::error ? 0x2400u : 0u;
      break;
    case kCyclicVelocity:
    case kCyclicTorque:
    case kCyclicPosition:
      word |= (denies ? 0u : 0x1000u) |
              (lags ? 0x2000u : 0u);  // bit 12: the drive follows its set-point
      break;
    default:
      break;
  }
  return static_cast<std::uint16_t>(word);
}

void Drive::update_objects() {
  Dictionary& o = slave_.objects;
  const cia402::Axis& axis = config_.axis;
  const bool enabled = state_ == operation_enabled && in_position_mode();
  const auto clipped = [](double x, double most) {
    return static_cast<std::int64_t>(std::clamp(x, -most - 1, most));
  };
  o.set(0x6062'00, counts(enabled ? reference_ : held()));
  o.set(0x6064'00, counts(position_rad()));
  o.set(0x606C'00,
        clipped(std::round(axis.sign * velocity_rad_s() * axis.increments_per_rad), kMostCounts));
  o.set(0x6077'00, clipped(1e3 * axis.sign * torque_n_m() / axis.rated_torque_n_m, 32767.0));
  o.set(0x6041'00, statusword());
  if (state_ != operation_enabled) show_mode();
  o.set(0x60F4'00, enabled ? counts(reference_) - counts(position_rad()) : 0);
  o.set(0x60FD'00, (switch_pressed(-axis.sign) ? 1 : 0) | (switch_pressed(axis.sign) ? 2 : 0) |
                       (trouble_ == Trouble::emergency_stop ? 0 : 8));
}

void Drive::move(Time now, Frames& out) {
  if (!started_) {
    now_ = now;
    if (config_.habits.late_boot) inject(Trouble::power, milliseconds(3000));
    if (!trouble_ || !silences(*trouble_)) slave_.boot(out);
  }
  started_ = true;
  if (trouble_ends_ && now >= *trouble_ends_) end_trouble(out);
  const Time passed = trouble_ == Trouble::stall ? Time(0) : std::max(now - now_, Time(0));
  own_time_ += passed;
  now_ = now;
  moved_s_ = to_seconds(passed);
  if (moved_s_ > 0.0) move_joint(moved_s_);
}

void Drive::watch(Frames& out) {
  if (trouble_ == Trouble::stall || trouble_ == Trouble::power) return;
  const std::size_t before = out.size();
  if (state_ == operation_enabled && moved_s_ > 0.0) {
    const double error = std::abs(reference_ - position_rad()) * config_.axis.increments_per_rad;
    const bool lags = in_position_mode() && error > static_cast<double>(value(0x6065'00));
    lag_s_ = lags ? lag_s_ + moved_s_ : 0.0;
  }
  react(slave_.advance(own_time_, out), out);
  if (state_ == operation_enabled && lag_s_ * 1e3 > static_cast<double>(value(0x6066'00)))
    fail(0x8611, 0x20, out);
  if (next_trouble_ == Trouble::overcurrent) fail(0x2310, 0x02, out);
  if (next_trouble_ == Trouble::over_temperature) {
    slave_.objects.set(0x2F10'00, 105);
    fail(0x4310, 0x08, out);
  }
  next_trouble_.reset();
  if (config_.habits.emergencies && slave_.operational() && own_time_ >= emergency_due_) {
    slave_.clear_error(out);
    emergency_due_ = own_time_ + milliseconds(100);
  }
  update_objects();
  if (trouble_ && silences(*trouble_)) out.resize(before);
}

void Drive::handle(const Frame& frame, Frames& out) {
  if (trouble_ && silences(*trouble_)) return;
  react(slave_.handle(frame, out), out);
  if (frame.id != 0x600u + static_cast<unsigned>(config_.axis.node_id)) return;  // no SDO
  if (state_ != operation_enabled) show_mode();
  const std::int64_t kind = value(0x2F00'01);
  if (kind == 0) return;
  slave_.objects.set(0x2F00'01, 0);
  inject(static_cast<Trouble>(kind), milliseconds(value(0x2F00'02)));
}

namespace {

using can::Frame;

// A bus keeps no more frames for a process that waits; beyond, the drives' watchdogs decide.
constexpr std::chrono::milliseconds kLongestWait(50);

}  // namespace

Rack::Rack(const std::vector<DriveConfig>& configs, std::unique_ptr<can::Bus> bus)
    : bus_(std::move(bus)) {
  for (const DriveConfig& config : configs) drives_.emplace_back(config);
}

void Rack::move(Time now) {
  for (Drive& drive : drives_) drive.move(now, outbox_);
}

/// Frames that have arrived, at most so many: the rest of a flood waits for the next step.
void Rack::receive() {
  constexpr std::size_t kAtOnce = 256, kMost = 16 * kAtOnce;
  std::size_t count = kAtOnce, filled = 0;
  for (; count == kAtOnce && filled < kMost; filled += count) {
    inbox_.resize(filled + kAtOnce);
    count = bus_->receive(std::span(inbox_).subspan(filled));
  }
  inbox_.resize(filled);
}

void Rack::answer(std::span<const Frame> frames) {
  for (Drive& drive : drives_) drive.watch(outbox_);
  for (const Frame& frame : frames) {
    for (Drive& drive : drives_) drive.handle(frame, outbox_);
  }
}

void Rack::answer() {
  receive();
  answer(inbox_);
  if (!outbox_.empty()) bus_->send(outbox_);
  outbox_.clear();
}

void Rack::step(Time now) {
  receive();
  const auto is_sync = [](const Frame& frame) { return frame.id == 0x080; };
  const Time passed = std::max(now - stepped_.value_or(now), Time(0));
  stepped_ = now;
  const bool brief = passed <= kLongestWait;
  const auto parts =
      brief ? std::max(std::ranges::count_if(inbox_, is_sync), std::ptrdiff_t{1}) : 1;
  auto begin = inbox_.begin();
  for (auto left = parts; left-- > 0;) {
    auto end = left == 0 ? inbox_.end() : std::next(std::find_if(begin, inbox_.end(), is_sync));
    move(now - passed * left / parts);
    answer({begin, end});
    begin = end;
  }
  if (!outbox_.empty()) bus_->send(outbox_);
  outbox_.clear();
}

}  // namespace mimesis::hw::sim
