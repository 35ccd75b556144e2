// `mimesis hw check|monitor|jog`: a robot's drives by its machine file.
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "hw/cia402/joint_driver.h"
#include "tools/mimesis/hw/bus_watch.h"
#include "tools/mimesis/hw/hw_tools.h"
#include "tools/mimesis/stop_signals.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

namespace can = hw::can;
using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

std::string percent(double share) { return fmt::format("{:.0f} %", 100.0 * share); }

/// What is known of an axis: its name, and radians.
struct Known {
  std::string name;
  hw::cia402::Axis axis;
};

Json as_json(const BusWatch& watch, const HwOptions& options, const std::map<int, Known>& known) {
  Json axes = Json::array();
  for (const BusWatch::Node& n : watch.nodes()) {
    const auto k = known.find(n.id);
    Json axis{{"node", n.id}, {"state", hw::name(n.state)}, {"statusword", n.statusword}};
    axis["name"] = k != known.end() ? Json(k->second.name) : Json();
    axis["network"] = n.nmt ? Json(*n.nmt) : Json();
    const auto number = [&](const char* key, const std::optional<std::int32_t>& value) {
      axis[key] = value ? Json(*value) : Json();
    };
    number("position_increments", n.position);
    number("target_increments", n.target);
    if (k != known.end() && n.position) axis["position_rad"] = k->second.axis.to_rad(*n.position);
    axis["emergency"] = n.emergency;
    axis["frames_s"] = n.frames_s;
    axes.push_back(axis);
  }
  return {{"bus", options.bus},
          {"frames_s", watch.frames_s()},
          {"syncs_s", watch.syncs_s()},
          {"load", watch.bits_s() / options.bitrate},
          {"error_frames", watch.error_frames()},
          {"bus_off", watch.bus_off()},
          {"axes", axes}};
}

void print_table(const BusWatch& watch, const HwOptions& options,
                 const std::map<int, Known>& known) {
  Table table({"NODE", "JOINT", "STATE", "POSITION", "ERROR", "TORQUE", "FRAMES/S", "EMERGENCY"});
  for (const BusWatch::Node& n : watch.nodes()) {
    const auto k = known.find(n.id);
    const auto amount = [&](std::int64_t increments, bool position) -> std::string {
      if (k == known.end()) return fmt::format("{}", increments);
      const auto value = static_cast<std::int32_t>(increments);
      return fmt::format("{:+.4f} rad", position ? k->second.axis.to_rad(value)
                                                 : k->second.axis.rate_to_rad(value));
    };
    const bool commanded = n.target && n.position && n.state == hw::DriveState::operation_enabled;
    table.row({std::to_string(n.id), k != known.end() ? k->second.name : "-", hw::name(n.state),
               n.position ? amount(*n.position, true) : "-",
               commanded ? amount(std::int64_t{*n.target} - *n.position, false) : "-",
               fmt::format("{:.1f} %", 0.1 * n.torque), fmt::format("{:.0f}", n.frames_s),
               n.emergency.empty() ? "-" : n.emergency});
  }
  if (use_colour(STDOUT_FILENO)) std::cout << "\x1b[H\x1b[2J";
  std::cout << fmt::format(
      "{}: {:.0f} frames/s, SYNC {:.0f}/s, load at most {}{}{}\n", options.bus, watch.frames_s(),
      watch.syncs_s(), percent(watch.bits_s() / options.bitrate),
      watch.error_frames() > 0 ? fmt::format(", {} error frames", watch.error_frames()) : "",
      watch.bus_off() ? ", BUS-OFF" : "");
  table.print(std::cout, use_colour(STDOUT_FILENO));
  std::cout.flush();
}

}  // namespace

int hw_check(const HwOptions& options) {
  const hw::Machine machine = hw::load_machine(options.file);
  const double rate_hz = machine.joints.rate_hz;
  const bool powered = machine.joints.walks;
  Json buses = Json::array(), joints = Json::array();
  Table table({"BUS", "BIT/S", "AXES", "LOAD", ""});
  double largest_hz = 1000.0;
  bool fits = true;
  for (std::size_t b = 0; b < machine.buses.size(); ++b) {
    const auto& [can, axes] = machine.buses[b];
    const int bitrate = machine.bitrates[b];
    const hw::BusLoad load = hw::bus_load(axes, rate_hz, bitrate, powered);
    const bool good = load.worst <= hw::kLargestLoad;
    fits = fits && good;
    largest_hz = std::min(largest_hz, hw::largest_rate(axes, bitrate, powered));
    buses.push_back({{"can", can},
                     {"bitrate_bit_s", bitrate},
                     {"axes", axes},
                     {"load_least", load.least},
                     {"load_worst", load.worst},
                     {"fits", good}});
    table.row({can, std::to_string(bitrate), std::to_string(axes),
               percent(load.least) + " to " + percent(load.worst), good ? "" : "too much"});
  }
  const int slowest = *std::ranges::min_element(machine.bitrates);
  const int most = hw::most_axes(rate_hz, slowest, powered);
  const int count = machine.joints.count();
  const int fewest = most > 0 ? (count + most - 1) / most : 0;
  for (std::size_t i = 0; i < machine.axes.size(); ++i) {
    const hw::cia402::Axis& axis = machine.axes[i];
    const auto k = static_cast<Eigen::Index>(i);
    const hw::JointLimits& l = machine.joints.limits;
    joints.push_back({{"name", machine.joints.names[i]},
                      {"node_id", axis.node_id},
                      {"increments_per_rad", axis.increments_per_rad},
                      {"sign", axis.sign},
                      {"offset_rad", axis.offset_rad},
                      {"q_min_rad", l.q_min[k]},
                      {"q_max_rad", l.q_max[k]},
                      {"v_max_rad_s", l.v_max[k]},
                      {"a_max_rad_s2", l.a_max[k]}});
  }
  if (options.json) {
    std::cout << Json{{"file", options.file},
                      {"robot", machine.robot},
                      {"rate_hz", rate_hz},
                      {"fits", fits},
                      {"largest_rate_hz", largest_hz},
                      {"fewest_buses", fewest},
                      {"buses", buses},
                      {"joints", joints}}
                     .dump()
              << '\n';
    return fits ? 0 : 1;
  }
  table.print(std::cout, use_colour(STDOUT_FILENO));
  std::cout << fmt::format("{} axes at {:.4g} Hz: {}; up to {} of a bus may be in use.\n", count,
                           rate_hz, fits ? "fits" : "DOES NOT FIT", percent(hw::kLargestLoad));
  std::cout << (largest_hz > 0.0
                    ? fmt::format("Largest rate on these buses: {:.4g} Hz. ", largest_hz)
                    : "No rate fits on these buses. ")
            << (fewest > 0 ? fmt::format("Fewest buses at {:.4g} Hz: {}, with up to {} axes.\n",
                                         rate_hz, fewest, most)
                           : fmt::format("No axis fits at {:.4g} Hz.\n", rate_hz));
  return fits ? 0 : 1;
}

int hw_monitor(const HwOptions& options) {
  constexpr std::chrono::milliseconds kInterval(500);
  std::map<int, Known> known;
  if (!options.file.empty()) {
    const hw::Machine machine = hw::load_machine(options.file);
    for (std::size_t i = 0; i < machine.axes.size(); ++i)
      known[machine.axes[i].node_id] = {machine.joints.names[i], machine.axes[i]};
  }
  const auto bus = open_bus(options.bus, options);
  const std::string name = options.bus.substr(options.bus.find(':') + 1);
  StopSignals signals;
  BusWatch watch;
  std::array<can::Frame, 64> frames;
  int shown = 0;
  Clock::time_point begin = Clock::now();
  const auto enough = [&] { return options.count > 0 && shown >= options.count; };
  while (!signals.requested() && !enough()) {
    const std::size_t count = bus->receive(frames);
    const hw::Time stamp = std::chrono::system_clock::now().time_since_epoch();
    for (const can::Frame& frame : std::span(frames).first(count)) {
      watch.observe(frame);
      if (!options.frames || enough()) continue;
      std::cout << candump_line(frame, stamp, name) << '\n';
      ++shown;
    }
    if (count > 0) continue;
    std::cout.flush();
    const auto now = Clock::now();
    if (!options.frames && now - begin >= kInterval) {
      watch.close_interval(to_seconds(now - begin));
      begin = now;
      ++shown;
      if (options.json)
        std::cout << as_json(watch, options, known).dump() << '\n' << std::flush;
      else
        print_table(watch, options, known);
    }
    poll(nullptr, 0, 1);
  }
  return signals.requested() && options.count > 0 ? 130 : 0;
}

int hw_jog(const HwOptions& options) {
  const hw::Machine machine = hw::load_machine(options.file);
  const auto found = std::ranges::find(machine.joints.names, options.joint);
  if (found == machine.joints.names.end())
    throw ConfigError(fmt::format("JOINT '{}': {} has {}", options.joint, machine.robot,
                                  fmt::join(machine.joints.names, ", ")));
  const auto index = static_cast<int>(found - machine.joints.names.begin());
  const hw::JointLimits limits = hw::part_of(machine.joints.limits, index, 1);
  if (options.speed_rad_s > limits.v_max[0])
    throw ConfigError(
        fmt::format("--speed {}: expected at most {} rad/s", options.speed_rad_s, limits.v_max[0]));
  std::size_t b = 0;
  for (int before = machine.buses[0].joints; before <= index; before += machine.buses[++b].joints) {
  }
  const std::string address = machine.buses[b].can;
  const double rate_hz = machine.joints.rate_hz;
  auto bus = open_bus(address, options);
  {  // two masters on a bus would fight
    std::array<can::Frame, 64> frames;
    for (const auto until = Clock::now() + std::chrono::milliseconds(300); Clock::now() < until;
         poll(nullptr, 0, 1)) {
      const std::size_t count = bus->receive(frames);
      for (const can::Frame& f : std::span(frames).first(count)) {
        if (f.id == 0x080)
          throw VerbFailure{address + ": another master sends SYNC; stop it first", 1};
      }
    }
  }
  hw::cia402::JointDriver driver({.axes = {machine.axes[static_cast<std::size_t>(index)]},
                                  .names = {options.joint},
                                  .limits = limits,
                                  .rate_hz = rate_hz,
                                  .boot_timeout_s = options.timeout_s},
                                 std::move(bus));
  StopSignals signals;
  const hw::Time cycle = from_seconds(1.0 / rate_hz);
  hw::Time next = Clock::now().time_since_epoch();
  std::array<double, 1> q{};
  /// Cycles until `done`, a signal or a fault. True if done.
  const auto run = [&](hw::Mode mode, const auto& done) {
    for (;;) {
      const hw::Time now = Clock::now().time_since_epoch();
      const hw::Reading& reading = driver.read(now);
      if (reading.phase == hw::Phase::fault)
        throw VerbFailure{reading.reason, reading.reason.starts_with("no answer") ? kNotFound : 1};
      if (done(reading, now)) return true;
      driver.write(now, {.mode = mode, .position_rad = q});
      if (signals.requested()) return false;
      next = std::max(next + cycle, now);
      while (Clock::now().time_since_epoch() < next) poll(nullptr, 0, 1);
    }
  };
  const auto position = [&] { return driver.reading().joints[0].position_rad; };
  const auto rest = [](const hw::Reading& r, hw::Time) {
    return r.phase == hw::Phase::idle && r.posture_known;
  };
  run(hw::Mode::idle, rest);
  const double from = position(), to = from + options.by_rad;
  if (to < limits.q_min[0] || to > limits.q_max[0]) {
    throw ConfigError(fmt::format("--by {}: {} is at {:.4f} rad, its limits are {:.4f} and {:.4f}",
                                  options.by_rad, options.joint, from, limits.q_min[0],
                                  limits.q_max[0]));
  }
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
  if (options.json) {
    std::cout << Json{{"joint", options.joint}, {"from_rad", from}, {"to_rad", reached}}.dump()
              << '\n';
  } else {
    std::cout << fmt::format("{}: {:.4f} to {:.4f} rad\n", options.joint, from, reached);
  }
  return arrived ? 0 : 130;
}

}  // namespace mimesis::tool
