// `mimesis hw jog|try`: one joint without a bridge.
#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/json_text.h"
#include "hw/cia402/joint_driver.h"
#include "hw/cia402/mode_axis.h"
#include "tools/mimesis/hw/hw_tools.h"
#include "tools/mimesis/stop_signals.h"

namespace mimesis::tool {
namespace {

namespace can = hw::can;
using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

/// A joint of a machine file, and its bus, on which no other master is.
struct OneJoint {
  hw::cia402::Axis axis;
  hw::JointLimits limits;
  double rate_hz;
  std::unique_ptr<can::Bus> bus;
};

OneJoint one_joint(const HwOptions& options) {
  const hw::Machine machine = hw::load_machine(options.file);
  const auto found = std::ranges::find(machine.joints.names, options.joint);
  if (found == machine.joints.names.end())
    throw ConfigError(fmt::format("JOINT '{}': {} has {}", options.joint, machine.robot,
                                  fmt::join(machine.joints.names, ", ")));
  const auto index = static_cast<int>(found - machine.joints.names.begin());
  OneJoint one{.axis = machine.axes[static_cast<std::size_t>(index)],
               .limits = hw::part_of(machine.joints.limits, index, 1),
               .rate_hz = machine.joints.rate_hz,
               .bus = nullptr};
  if (options.speed_rad_s > one.limits.v_max[0])
    throw ConfigError(fmt::format("--speed {}: expected at most {} rad/s", options.speed_rad_s,
                                  one.limits.v_max[0]));
  std::size_t b = 0;
  for (int before = machine.buses[0].joints; before <= index; before += machine.buses[++b].joints) {
  }
  one.bus = open_bus(machine.buses[b].can, options);
  // Two masters on a bus would fight.
  std::array<can::Frame, 64> frames;
  for (const auto until = Clock::now() + std::chrono::milliseconds(300); Clock::now() < until;
       poll(nullptr, 0, 1)) {
    const std::size_t count = one.bus->receive(frames);
    for (const can::Frame& f : std::span(frames).first(count)) {
      const bool sync = f.id == 0x080, lives = f.id == 0x700 + hw::cia402::kMasterNode;
      if (sync || lives)
        throw VerbFailure{fmt::format("{}: another master sends {}; stop it first",
                                      machine.buses[b].can, sync ? "SYNC" : "its heartbeat"),
                          1};
    }
  }
  return one;
}

/// Calls `cycle(now)` at an even pace until it returns true; false after a signal.
template <class Cycle>
bool paced(StopSignals& signals, double rate_hz, const Cycle& cycle) {
  const hw::Time period = from_seconds(1.0 / rate_hz);
  for (hw::Time next = Clock::now().time_since_epoch();;) {
    const hw::Time now = Clock::now().time_since_epoch();
    if (cycle(now)) return true;
    if (signals.requested()) return false;
    next = std::max(next + period, now);
    while (Clock::now().time_since_epoch() < next) poll(nullptr, 0, 1);
  }
}

void refuse_beyond(const HwOptions& options, const std::string& what, double from, double to,
                   const hw::JointLimits& limits) {
  if (to >= limits.q_min[0] && to <= limits.q_max[0]) return;
  throw ConfigError(fmt::format("{}: {} is at {:.4f} rad, its limits are {:.4f} and {:.4f}", what,
                                options.joint, from, limits.q_min[0], limits.q_max[0]));
}

int show(const HwOptions& options, double from, double to, bool done) {
  if (options.json) {
    std::cout << json_text(Json{{"joint", options.joint}, {"from_rad", from}, {"to_rad", to}})
              << '\n';
  } else {
    std::cout << fmt::format("{}: {:.4f} to {:.4f} rad\n", options.joint, from, to);
  }
  return done ? 0 : 130;
}

hw::cia402::OperationMode mode_of(const std::string& kind) {
  using enum hw::cia402::OperationMode;
  return kind == "home"       ? homing
         : kind == "position" ? profile_position
         : kind == "velocity" ? cyclic_velocity
                              : cyclic_torque;
}

}  // namespace

int hw_jog(const HwOptions& options) {
  OneJoint one = one_joint(options);
  hw::cia402::JointDriver driver({.axes = {one.axis},
                                  .names = {options.joint},
                                  .limits = one.limits,
                                  .rate_hz = one.rate_hz,
                                  .boot_timeout_s = options.timeout_s},
                                 std::move(one.bus));
  StopSignals signals;
  std::array<double, 1> q{};
  /// Cycles until `done`, a signal or a fault. True if done.
  const auto run = [&](hw::Mode mode, const auto& done) {
    return paced(signals, one.rate_hz, [&](hw::Time now) {
      const hw::Reading& reading = driver.read(now);
      if (reading.phase == hw::Phase::fault)
        throw VerbFailure{reading.reason, reading.reason.starts_with("no answer") ? kNotFound : 1};
      if (done(reading, now)) return true;
      driver.write(now, {.mode = mode, .position_rad = q});
      return false;
    });
  };
  const auto position = [&] { return driver.reading().joints[0].position_rad; };
  const auto rest = [](const hw::Reading& r, hw::Time) {
    return r.phase == hw::Phase::idle && r.posture_known;
  };
  run(hw::Mode::idle, rest);
  const double from = position(), to = from + options.by_rad;
  refuse_beyond(options, fmt::format("--by {}", options.by_rad), from, to, one.limits);
  q[0] = from;
  run(hw::Mode::follow,
      [](const hw::Reading& r, hw::Time) { return r.phase == hw::Phase::following; });
  const double duration_s =
      M_PI * std::abs(options.by_rad) / (2.0 * options.speed_rad_s);  // of a cosine
  const hw::Time begin = Clock::now().time_since_epoch();
  const bool arrived = run(hw::Mode::follow, [&](const hw::Reading&, hw::Time now) {
    const double t = std::min(1.0, to_seconds(now - begin) / duration_s);
    q[0] = from + options.by_rad * (1.0 - std::cos(M_PI * t)) / 2.0;
    return to_seconds(now - begin) > duration_s + 0.2;
  });
  const double reached = position();
  const hw::Time stop = Clock::now().time_since_epoch();
  run(hw::Mode::idle, [&](const hw::Reading& r, hw::Time now) {
    return rest(r, now) || now - stop > std::chrono::seconds(3);
  });
  driver.stop();
  return show(options, from, reached, arrived);
}

int hw_try(const HwOptions& options) {
  const auto mode = mode_of(options.kind);
  const bool timed = options.kind == "velocity" || options.kind == "torque";
  if (timed && options.duration_s <= 0.0)
    throw ConfigError("--for: expected how long, more than 0 s");
  if (!timed && options.speed_rad_s <= 0.0)
    throw ConfigError("--speed: expected more than 0 rad/s");
  OneJoint one = one_joint(options);
  const double v_max = one.limits.v_max[0], a_max = one.limits.a_max[0];
  const double most = options.kind == "torque" ? one.axis.rated_torque_n_m : v_max;
  const bool within = options.kind == "position" ? options.amount >= one.limits.q_min[0] &&
                                                       options.amount <= one.limits.q_max[0]
                                                 : !timed || std::abs(options.amount) <= most;
  if (!within)
    throw ConfigError(fmt::format("AMOUNT {}: expected {} to {}", options.amount,
                                  timed ? -most : one.limits.q_min[0],
                                  timed ? most : one.limits.q_max[0]));
  hw::cia402::ModeAxis axis(options.joint, one.axis,
                            {.q_min = one.limits.q_min[0],
                             .q_max = one.limits.q_max[0],
                             .v_max = v_max,
                             .a_max = a_max,
                             .mode = mode,
                             .profile_v = options.speed_rad_s,
                             .homing_method = options.method},
                            one.rate_hz, std::move(one.bus));
  StopSignals signals;
  const hw::Time give_up = Clock::now().time_since_epoch() + from_seconds(options.timeout_s);
  std::optional<double> from;
  std::optional<hw::Time> begin;
  std::string stopped;
  const bool done = paced(signals, one.rate_hz, [&](hw::Time now) {
    axis.cycle(now, true);
    if (!axis.failure().empty()) return true;
    if (!axis.enabled() && !begin) {
      if (now > give_up)
        stopped = fmt::format("not enabled within {:.3g} s, is {}", options.timeout_s,
                              hw::text(axis.reading()));
      return !stopped.empty();
    }
    const hw::JointReading& r = axis.reading();
    if (!begin) {
      begin = now;
      from = r.position_rad;
      if (options.kind == "position") axis.move_to(options.amount);
      if (options.kind == "velocity") axis.turn(options.amount);
      if (options.kind == "torque") axis.push(options.amount);
    }
    // These modes know no position limits: room to brake is left.
    const double v = r.velocity_rad_s, stop_at = r.position_rad + v * std::abs(v) / (2.0 * a_max);
    if (timed && (stop_at < one.limits.q_min[0] || stop_at > one.limits.q_max[0]))
      stopped = "stopped before the end of its range";
    if (std::abs(v) > 1.1 * v_max) stopped = "stopped, it is faster than its limit";
    return !stopped.empty() || axis.done() ||
           (timed && to_seconds(now - *begin) >= options.duration_s);
  });
  const double reached = axis.reading().position_rad;
  const hw::Time stop = Clock::now().time_since_epoch();
  StopSignals again;
  paced(again, one.rate_hz, [&](hw::Time now) {
    axis.cycle(now, false);
    return axis.reading().drive == hw::DriveState::switch_on_disabled ||
           now - stop > std::chrono::seconds(3);
  });
  if (!axis.failure().empty()) throw VerbFailure{axis.failure(), 1};
  if (!stopped.empty())
    throw VerbFailure{options.joint + ": " + stopped, axis.known() ? 1 : kNotFound};
  return show(options, from.value_or(reached), reached, done);
}

}  // namespace mimesis::tool
