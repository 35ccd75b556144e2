// `mimesis hw check|monitor`: a robot's drives by its machine file.
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "common/json_text.h"
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
    axis["temperature_c"] = n.temperature ? Json(*n.temperature * options.degrees_c) : Json();
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
  TextTable table({"NODE", "JOINT", "STATE", "POSITION", "ERROR", "TORQUE", "TEMPERATURE",
                   "FRAMES/S", "EMERGENCY"});
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
               fmt::format("{:.1f} %", 0.1 * n.torque),
               n.temperature ? fmt::format("{:.0f} °C", *n.temperature * options.degrees_c) : "-",
               fmt::format("{:.0f}", n.frames_s), n.emergency.empty() ? "-" : n.emergency});
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
  std::span<const hw::cia402::Axis> rest = machine.axes;
  Json buses = Json::array(), joints = Json::array();
  TextTable table({"BUS", "BIT/S", "AXES", "LOAD", ""});
  double largest_hz = 1000.0;
  bool fits = true;
  for (std::size_t b = 0; b < machine.buses.size(); ++b) {
    const std::string& can = machine.buses[b].can;
    const int count = machine.buses[b].joints;
    const auto axes = rest.first(static_cast<std::size_t>(count));
    rest = rest.subspan(axes.size());
    const int bitrate = machine.bitrates[b];
    const hw::BusLoad load = hw::bus_load(axes, machine.joints, rate_hz, bitrate);
    const bool good = load.worst <= hw::kLargestLoad;
    fits = fits && good;
    largest_hz = std::min(largest_hz, hw::largest_rate(axes, machine.joints, bitrate));
    buses.push_back({{"can", can},
                     {"bitrate_bit_s", bitrate},
                     {"axes", count},
                     {"load_least", load.least},
                     {"load_worst", load.worst},
                     {"fits", good}});
    table.row({can, std::to_string(bitrate), std::to_string(count),
               percent(load.least) + " to " + percent(load.worst), good ? "" : "too much"});
  }
  const DriveCheck drives = check_drives(machine, options);
  const int exit_code = fits && drives.usable ? 0 : 1;
  const int slowest = *std::ranges::min_element(machine.bitrates);
  const int fewest = hw::fewest_buses(machine.axes, machine.joints, rate_hz, slowest);
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
    std::cout << json_text(Json{{"file", options.file},
                                {"robot", machine.robot},
                                {"rate_hz", rate_hz},
                                {"fits", fits},
                                {"largest_rate_hz", largest_hz},
                                {"fewest_buses", fewest},
                                {"buses", buses},
                                {"joints", joints},
                                {"drives", as_json(drives)}})
              << '\n';
    return exit_code;
  }
  table.print(std::cout, use_colour(STDOUT_FILENO));
  std::cout << fmt::format("{} axes at {:.4g} Hz: {}; up to {} of a bus may be in use.\n",
                           machine.axes.size(), rate_hz, fits ? "fits" : "DOES NOT FIT",
                           percent(hw::kLargestLoad));
  std::cout << (largest_hz > 0.0
                    ? fmt::format("Largest rate on these buses: {:.4g} Hz. ", largest_hz)
                    : "No rate fits on these buses. ")
            << (fewest > 0 ? fmt::format("Fewest buses at {:.4g} Hz: {}.\n", rate_hz, fewest)
                           : fmt::format("One axis alone does not fit at {:.4g} Hz.\n", rate_hz));
  print(drives);
  return exit_code;
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
  std::optional<hw::cia402::Object> temperature;
  if (!options.object.empty()) temperature = object_of(options.object);
  BusWatch watch(temperature);
  std::array<can::Frame, 64> frames;
  int shown = 0;
  Clock::time_point begin = Clock::now();
  const auto enough = [&] { return options.count > 0 && shown >= options.count; };
  while (!signals.requested() && !enough()) {
    const std::size_t count = bus->receive(frames);
    const hw::Time now_stamp = std::chrono::system_clock::now().time_since_epoch();
    for (std::size_t i = 0; i < count; ++i) {
      watch.observe(frames[i]);
      if (!options.frames || enough()) continue;
      const hw::Time stamp = i < bus->stamps().size() ? bus->stamps()[i] : now_stamp;
      std::cout << candump_line(frames[i], stamp, name) << '\n';
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
        std::cout << json_text(as_json(watch, options, known)) << '\n' << std::flush;
      else
        print_table(watch, options, known);
      for (const BusWatch::Node& n : watch.nodes()) {
        if (temperature) bus->send(std::array{hw::cia402::sdo_upload(n.id, *temperature)});
      }
    }
    poll(nullptr, 0, 1);
  }
  return signals.requested() && options.count > 0 ? 130 : 0;
}

}  // namespace mimesis::tool
