#include "hw/bridge/bridge_params.h"

#include <map>
#include <random>

#include "common/error.h"
#include "common/model/files.h"
#include "hw/cia402/joint_driver.h"
#include "hw/joints/machine.h"
#include "hw/outside/recorded.h"
#include "hw/powercube/driver.h"
#include "hw/udp/driver.h"

namespace mimesis::hw::bridge {
namespace {

constexpr double kPatience_s = 0.1, kTracking_rad = 0.1;

double feedback_timeout_s(const ActuatorsRequest& request, const std::string& can) {
  const BridgeParams& p = request.params;
  if (p.feedback_timeout_s > 0.0) return p.feedback_timeout_s;
  const bool prompt = can.starts_with("socketcan:") || request.graph.lockstep();
  return prompt ? (p.missed_syncs - 0.5) / request.joints.rate_hz : kPatience_s;
}

std::unique_ptr<can::Bus> open_bus(const std::string& can, const ActuatorsRequest& request,
                                   std::span<const cia402::Axis> axes) {
  auto bus = outside::open_can(can, request.graph, request.params.readonly ? "listener" : "master",
                               text_of(request.params.robot, axes));
  return request.frames == nullptr ? std::move(bus) : request.frames->tap(std::move(bus), can);
}

/// The driver of the joints from `first` on that share this bus.
cia402::JointDriverOptions driver_options(const ActuatorsRequest& request, int first,
                                          const BusShare& bus) {
  const auto& [p, joints, stays_powered, graph, frames] = request;
  const auto range = [&](const auto& all) {
    return std::vector(all.begin() + first, all.begin() + first + bus.joints);
  };
  return {
      .axes = range(complete(p.axes, joints)),
      .names = range(joints.names),
      .limits = part_of(joints.limits, first, bus.joints),
      .rate_hz = joints.rate_hz,
      .boot_timeout_s = p.boot_timeout_s,
      .transition_timeout_s = p.transition_timeout_s,
      .feedback_timeout_s = feedback_timeout_s(request, bus.can),
      .missed_syncs = p.missed_syncs,
      .following_window_rad = p.following_window_rad,
      .following_time_s = p.following_time_s,
      .tracking_window_rad = p.tracking_window_rad > 0.0 ? p.tracking_window_rad
                             : joints.walks              ? 0.0
                                                         : kTracking_rad,
      .readonly = p.readonly,
      .exclusive = bus.exclusive,
      .sdo_timeout_s = bus.sdo_timeout_s,
      .quick_stop = stays_powered ? cia402::QuickStop::stays_powered : cia402::QuickStop::disables};
}

std::unique_ptr<Actuators> make_cia402(const ActuatorsRequest& request) {
  const BridgeParams& p = request.params;
  std::vector<std::unique_ptr<cia402::JointDriver>> drivers;
  int first = 0;
  for (const BusShare& bus : complete(p.buses, p.can, request.joints)) {
    const cia402::JointDriverOptions options = driver_options(request, first, bus);
    drivers.push_back(
        std::make_unique<cia402::JointDriver>(options, open_bus(bus.can, request, options.axes)));
    first += bus.joints;
  }
  return std::make_unique<cia402::GroupDriver>(std::move(drivers));
}

std::unique_ptr<Actuators> make_powercube(const ActuatorsRequest& request) {
  const auto& [p, joints, stays_powered, graph, frames] = request;
  const std::vector<BusShare> buses = complete(p.buses, p.can, joints);
  const std::vector<cia402::Axis> axes = complete(p.axes, joints);
  for (const cia402::Axis& axis : axes) {
    if (axis.guarding || axis.mode != "csp")
      throw ConfigError(
          "axes: guarding and mode are of CANopen drives, PowerCube modules have none");
  }
  if (buses.size() != 1)
    throw ConfigError("buses: PowerCube modules stand on one bus, there are more");
  return std::make_unique<powercube::Driver>(
      powercube::DriverOptions{
          .axes = axes,
          .names = joints.names,
          .limits = joints.limits,
          .rate_hz = joints.rate_hz,
          .boot_timeout_s = p.boot_timeout_s,
          .feedback_timeout_s = p.feedback_timeout_s > 0.0 ? p.feedback_timeout_s : kPatience_s,
          .readonly = p.readonly},
      open_bus(buses[0].can, request, axes));
}

std::unique_ptr<Actuators> make_udp(const ActuatorsRequest& request) {
  const auto& [p, joints, stays_powered, graph, frames] = request;
  if (p.controller.empty())
    throw ConfigError("controller: expected HOST:PORT of the controller, since " + p.robot +
                      " has drives: udp");
  if (!p.buses.empty() || !p.axes.empty() || p.log_frames)
    throw ConfigError("buses, axes, machine, log_frames: are of drives on a bus, " + p.robot +
                      " has drives: udp");
  if (stays_powered)
    throw ConfigError(p.robot +
                      ": drives: udp of a robot that walks: its stop takes the power away");
  // Equal runs in lock-step have equal records.
  const bool equal = graph.lockstep();
  const auto session = runtime::read_outside_value<std::uint32_t>(
      graph, "udp", [equal] { return equal ? 1u : std::random_device{}() | 1u; });
  return std::make_unique<udp::Driver>(
      udp::DriverOptions{
          .address = p.controller,
          .names = joints.names,
          .limits = joints.limits,
          .rate_hz = joints.rate_hz,
          .boot_timeout_s = p.boot_timeout_s,
          .feedback_timeout_s = p.feedback_timeout_s > 0.0 ? p.feedback_timeout_s : kPatience_s,
          .tracking_window_rad =
              p.tracking_window_rad > 0.0 ? p.tracking_window_rad : kTracking_rad,
          .session = session,
          .readonly = p.readonly},
      outside::open_udp(p.controller, graph, p.robot));
}

std::map<std::string, MakeActuators>& known_actuators() {
  static std::map<std::string, MakeActuators> kinds{
      {"cia402", make_cia402}, {"powercube", make_powercube}, {"udp", make_udp}};
  return kinds;
}

}  // namespace

double BridgeParams::robot_rate_hz() const {
  return machine.empty() ? model::rate_of_robot(robot) : load_machine(machine).joints.rate_hz;
}

Joints take_machine(BridgeParams& params) {
  if (params.machine.empty()) return load_joints(params.robot);
  if (!params.buses.empty() || !params.axes.empty())
    throw ConfigError("machine: the file holds buses and axes, and there are more of them");
  Machine machine = load_machine(params.machine);
  params.robot = machine.robot;
  params.buses = machine.buses;
  params.axes = machine.axes;
  return machine.joints;
}

void add_actuators(const std::string& kind, MakeActuators make) {
  known_actuators()[kind] = std::move(make);
}

std::unique_ptr<Actuators> make_actuators(const ActuatorsRequest& request) {
  const std::string& drives = request.joints.drives;
  if (!request.params.controller.empty() && (drives == "cia402" || drives == "powercube"))
    throw ConfigError("controller: is of robots with drives: udp, not with drives: " + drives);
  const auto found = known_actuators().find(request.joints.drives);
  if (found != known_actuators().end()) return found->second(request);
  std::string known;
  for (const auto& [kind, make] : known_actuators()) known += (known.empty() ? "" : ", ") + kind;
  throw ConfigError(request.params.robot + ": drives: '" + request.joints.drives +
                    "' is not known, expected one of " + known);
}

}  // namespace mimesis::hw::bridge
