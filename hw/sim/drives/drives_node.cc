#include "hw/sim/drives/drives_node.h"

#include <algorithm>

#include "common/error.h"
#include "common/model/files.h"
#include "hw/joints/machine.h"
#include "hw/outside/recorded.h"

namespace mimesis::hw::sim {
namespace {

/// The values that the bridge assumes, unless parameters say others.
Machine machine_of(const DrivesParams& p) {
  if (!p.machine.empty()) {
    if (!p.axes.empty())
      throw ConfigError("machine: the file holds axes, and there are more of them");
    return load_machine(p.machine);
  }
  Machine machine{.robot = p.robot, .joints = load_joints(p.robot)};
  machine.buses = {{.can = p.bus, .joints = machine.joints.count()}};
  machine.axes = cia402::complete(p.axes, machine.joints.count());
  return machine;
}

DriveConfig config_of(const DrivesParams& p, const Machine& machine, int joint) {
  const Joints& joints = machine.joints;
  DriveConfig config{.axis = machine.axes[static_cast<std::size_t>(joint)],
                     .plant = {.bandwidth_rad_s = p.bandwidth_rad_s,
                               .v_max_rad_s = p.v_margin * joints.limits.v_max[joint],
                               .a_max_rad_s2 = p.a_margin * joints.limits.a_max[joint]},
                     .home_rad = joints.home[joint],
                     .extrapolated_cycles = joints.extrapolated_cycles,
                     .following_window_rad = p.following_window_rad,
                     .following_time_s = p.following_time_s};
  take_habits(config, p.habits);
  return config;
}

Trouble trouble_of(const std::string& kind) {
  return kind == "mute" ? Trouble::mute : kind == "jam" ? Trouble::jam : Trouble::overcurrent;
}

}  // namespace

double DrivesParams::robot_rate_hz() const {
  return machine.empty() ? model::rate_of_robot(robot) : load_machine(machine).joints.rate_hz;
}

DrivesNode::DrivesNode(const Params& params, runtime::Bus& bus)
    : params_(params), arm_(bus, "joint_states") {
  const Machine machine = machine_of(params);
  if (params.fault_axis > machine.joints.count()) {
    throw ConfigError("fault_axis: " + std::to_string(params.fault_axis) + ", the robot has " +
                      std::to_string(machine.joints.count()) + " joints");
  }
  int joint = 0;
  for (const BusShare& share : machine.buses) {
    std::vector<DriveConfig> drives;
    const std::span axes(machine.axes.data() + joint, static_cast<std::size_t>(share.joints));
    for (int i = 0; i < share.joints; ++i) drives.push_back(config_of(params, machine, joint++));
    racks_.push_back(std::make_unique<Rack>(
        drives, outside::open_can(share.can, bus, "drives", text_of(machine.robot, axes))));
  }
}

Drive& DrivesNode::drive(int joint) {
  auto rack = racks_.begin();
  while (joint >= std::ssize((*rack)->drives()))
    joint -= static_cast<int>((*rack++)->drives().size());
  return (*rack)->drives()[static_cast<std::size_t>(joint)];
}

void DrivesNode::make_trouble(runtime::Time now) {
  if (!trouble_at_) trouble_at_ = now + runtime::from_seconds(params_.fault_at_s);
  if (troubled_ || params_.fault_axis == 0 || now < *trouble_at_) return;
  troubled_ = true;
  drive(params_.fault_axis - 1).inject(trouble_of(params_.fault_kind));
}

void DrivesNode::step(runtime::Time now) {
  make_trouble(now);
  v1::JointState state;
  bool operational = true;
  for (const auto& rack : racks_) {
    rack->step(now);
    for (const Drive& drive : rack->drives()) {
      state.add_position_rad(drive.position_rad());
      state.add_velocity_rad_s(drive.velocity_rad_s());
      state.add_torque_n_m(drive.torque_n_m());
      state.add_drives(static_cast<v1::DriveState>(drive.state()));
      operational = operational && drive.state() == DriveState::operation_enabled;
    }
  }
  state.set_operational(operational);
  arm_.send(state, now);
}

bool DrivesNode::at_rest() const {
  const auto rests = [](const Drive& drive) {
    return drive.state() != DriveState::operation_enabled && drive.velocity_rad_s() == 0.0;
  };
  return std::ranges::all_of(
      racks_, [&](const auto& rack) { return std::ranges::all_of(rack->drives(), rests); });
}

}  // namespace mimesis::hw::sim
