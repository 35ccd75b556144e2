#include "hw/udp/driver.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/error.h"
#include "common/time.h"

namespace mimesis::hw::udp {
namespace {

constexpr double kBehind = 4.0;  // cycles that a joint may be behind its set-point
constexpr std::chrono::milliseconds kReset(500), kLongestStop(2000);

DriveState drive_of(Condition condition) {
  switch (condition) {
    case Condition::follows:
      return DriveState::operation_enabled;
    case Condition::enabling:
      return DriveState::switched_on;
    case Condition::stopping:
      return DriveState::quick_stop_active;
    case Condition::fault:
      return DriveState::fault;
    case Condition::off:
      break;
  }
  return DriveState::switch_on_disabled;
}

/// Whether number `a` comes after `b`, which may have begun again from 0.
bool after(std::uint32_t a, std::uint32_t b) { return static_cast<std::int32_t>(a - b) > 0; }

}  // namespace

Driver::Driver(DriverOptions options, std::unique_ptr<Link> link)
    : PhasedActuators(options.limits, options.rate_hz, "waits for the controller"),
      options_(std::move(options)),
      link_(std::move(link)) {
  const std::size_t n = reading_.joints.size();
  MIMESIS_ASSERT(options_.names.size() == n);
  posture_.resize(n);
  command_.header.session = options_.session;
  command_.watchdog_ms = static_cast<std::uint16_t>(std::lround(1e3 * options_.watchdog_s));
  command_.position_rad.resize(n);
  command_.velocity_rad_s.resize(n);
}

void Driver::lose(const std::string& why) {
  known_ = false;
  lost_ = true;
  fault(why);
}

void Driver::take(const State& state) {
  const Header &is = state.header, &was = state_.header;
  const bool again = is.session == was.session;
  if (again && !after(is.sequence, was.sequence)) {
    ++traffic_.errors;  // twice, or overtaken
    return;
  }
  if (again) traffic_.errors += is.sequence - was.sequence - 1;  // lost
  if (!again && known_) lose(controller() + " has restarted");
  state_ = state;
  heard_ = now_;
  fresh_ = true;
  const std::size_t n = reading_.joints.size();
  if (state.position_rad.size() != n) {
    return lose(fmt::format("{} has {} joints, the robot has {}", controller(),
                            state.position_rad.size(), n));
  }
  if (is.other_session != 0 && is.other_session != options_.session) {
    return lose(
        fmt::format("{} obeys another master (session {})", controller(), is.other_session));
  }
  const bool told = first_.other_session == is.session && !after(first_.sequence, is.heard);
  if (is.other_session == 0 || !told) return;  // it has not heard our order to stop
  for (std::size_t i = 0; i < n; ++i) {
    reading_.joints[i] = {.position_rad = state.position_rad[i],
                          .velocity_rad_s = state.velocity_rad_s[i],
                          .torque_n_m = state.torque_n_m[i],
                          .drive = drive_of(state.condition)};
  }
  if (!std::exchange(known_, true) && reading_.phase == Phase::starting) enter(Phase::idle);
  reading_.posture_known = true;
}

void Driver::supervise_tracking() {
  double farthest = 0.0;
  std::size_t joint = 0;
  for (std::size_t i = 0; i < posture_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double beyond = std::abs(reading_.joints[i].position_rad - limiter_.position()[k]) -
                          kBehind / options_.rate_hz * std::abs(limiter_.velocity()[k]);
    if (beyond <= farthest) continue;
    farthest = beyond;
    joint = i;
  }
  astray_ = farthest > options_.tracking_window_rad ? astray_ + 1 : 0;
  if (astray_ < 2) return;
  fault(
      fmt::format("{}: is {:.3f} rad farther from its set-point than its speed explains, allowed "
                  "are {:.3f}",
                  options_.names[joint], farthest, options_.tracking_window_rad));
}

void Driver::supervise() {
  const Time silence = now_ - heard_;
  if (known_ && silence > from_seconds(options_.feedback_timeout_s)) {
    return lose(
        fmt::format("{}: no state for {:.3g} s", controller(), options_.feedback_timeout_s));
  }
  if (!known_) {
    const bool late = now_ - entered_ > from_seconds(options_.boot_timeout_s);
    if (reading_.phase == Phase::starting && late) {
      lose(fmt::format("no answer within {:.3g} s from {}", options_.boot_timeout_s, controller()));
    }
    return;
  }
  const Condition is = state_.condition;
  if (is == Condition::fault && now_ >= reset_until_)
    return fault(fmt::format("{}: fault {}", controller(), state_.fault));
  switch (reading_.phase) {
    case Phase::enabling:
      if (is == Condition::follows) {
        limiter_.reset(posture_);
        astray_ = 0;
        enter(Phase::following);
      } else if (now_ - entered_ > from_seconds(options_.transition_timeout_s)) {
        fault(fmt::format("{}: expected following within {:.3g} s, is {}", controller(),
                          options_.transition_timeout_s, name(is)));
      }
      return;
    case Phase::following:
      if (is != Condition::follows)
        return fault(fmt::format("{}: expected following, is {}", controller(), name(is)));
      if (fresh_) supervise_tracking();
      return;
    case Phase::stopping:
      if (is == Condition::off) {
        enter(Phase::idle);
      } else if (now_ - entered_ > kLongestStop) {
        fault(fmt::format("{}: expected off within 2 s of the order to stop, is {}", controller(),
                          name(is)));
      }
      return;
    case Phase::fault:
      if (reset_until_ != Time{} && is == Condition::off) {
        reset_until_ = {};
        enter(Phase::idle);
      }
      return;
    default:
      return;
  }
}

const Reading& Driver::read(Time now) {
  now_ = now;
  if (!std::exchange(begun_, true)) entered_ = now;
  fresh_ = false;
  for (const std::string& datagram : link_->receive()) {
    const auto state = decode_state(datagram);
    ++(state ? traffic_.received : traffic_.errors);
    if (state) take(*state);
  }
  supervise();
  return reading_;
}

void Driver::send(Order order) {
  ++command_.header.sequence;
  command_.header.heard = state_.header.sequence;
  command_.header.other_session = state_.header.session;
  command_.order = order;
  if (command_.header.other_session != first_.other_session) first_ = command_.header;
  ++(link_->send(encode(command_)) ? traffic_.sent : traffic_.errors);
}

void Driver::stop() noexcept {
  if (options_.readonly) return;
  try {
    send(Order::stop);
  } catch (...) {  // the controller's watchdog is left
  }
  leave_motion();
}

void Driver::write(Time now, const Setpoint& setpoint) {
  now_ = now;
  if (options_.readonly) return;
  const Phase before = reading_.phase;
  obey(setpoint, known_ && state_.condition == Condition::off);
  if (lost_ && known_ && setpoint.mode != Mode::follow) {
    lost_ = false;
    enter(Phase::idle);
  }
  if (reading_.phase == Phase::enabling && before != Phase::enabling) {
    for (std::size_t i = 0; i < posture_.size(); ++i) posture_[i] = reading_.joints[i].position_rad;
  }
  const bool follows = reading_.phase == Phase::following;
  for (std::size_t i = 0; i < posture_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    command_.position_rad[i] = follows ? limiter_.position()[k] : posture_[i];
    command_.velocity_rad_s[i] = follows ? limiter_.velocity()[k] : 0.0;
  }
  const bool moves = follows || reading_.phase == Phase::enabling;
  send(moves ? Order::follow : now < reset_until_ ? Order::reset : Order::stop);
}

std::string Driver::reset_faults() {
  if (reading_.phase != Phase::fault) return "there is no fault";
  if (!known_) return "the controller is missing: " + reading_.reason;
  reset_until_ = now_ + kReset;
  return {};
}

}  // namespace mimesis::hw::udp
