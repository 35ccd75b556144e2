#include "hw/sim/drives/drives_node.h"

#include <algorithm>

#include "common/error.h"
#include "common/model/files.h"
#include "hw/outside/recorded.h"

namespace mimesis::hw::sim {
namespace {

std::vector<DriveConfig> configs(const DrivesParams& p) {
  const kin::ArmModel model = model::load_arm(p.robot);
  const std::vector<cia402::Axis> axes = cia402::complete(p.axes, model.dof());
  if (p.fault_axis > model.dof()) {
    throw ConfigError("fault_axis: " + std::to_string(p.fault_axis) + ", the robot has " +
                      std::to_string(model.dof()) + " joints");
  }
  std::vector<DriveConfig> drives;
  for (Eigen::Index i = 0; i < model.dof(); ++i) {
    drives.push_back({.axis = axes[static_cast<std::size_t>(i)],
                      .plant = {.bandwidth_rad_s = p.bandwidth_rad_s,
                                .v_max_rad_s = p.v_margin * model.v_max[i],
                                .a_max_rad_s2 = p.a_margin * model.a_max[i]},
                      .home_rad = model.home[i],
                      .extrapolated_cycles = model.extrapolated_cycles,
                      .following_window_rad = p.following_window_rad,
                      .following_time_s = p.following_time_s});
  }
  return drives;
}

Trouble trouble_of(const std::string& kind) {
  return kind == "mute" ? Trouble::mute : kind == "jam" ? Trouble::jam : Trouble::overcurrent;
}

}  // namespace

double DrivesParams::robot_rate_hz() const { return model::rate_of_robot(robot); }

DrivesNode::DrivesNode(const Params& params, runtime::Bus& bus)
    : params_(params),
      rack_(configs(params), outside::open_can(params.bus, bus)),
      arm_(bus, "arm") {}

void DrivesNode::make_trouble(runtime::Time now) {
  if (!trouble_at_) trouble_at_ = now + runtime::from_seconds(params_.fault_at_s);
  if (troubled_ || params_.fault_axis == 0 || now < *trouble_at_) return;
  troubled_ = true;
  rack_.drives()[static_cast<std::size_t>(params_.fault_axis - 1)].inject(
      trouble_of(params_.fault_kind));
}

void DrivesNode::step(runtime::Time now) {
  make_trouble(now);
  rack_.step(now);
  v1::JointState state;
  bool operational = true;
  for (const Drive& drive : rack_.drives()) {
    state.add_position_rad(drive.position_rad());
    state.add_velocity_rad_s(drive.velocity_rad_s());
    state.add_torque_n_m(drive.torque_n_m());
    state.add_drives(static_cast<v1::DriveState>(drive.state()));
    operational = operational && drive.state() == DriveState::operation_enabled;
  }
  state.set_operational(operational);
  arm_.send(state, now);
}

bool DrivesNode::at_rest() const {
  return std::ranges::all_of(rack_.drives(), [](const Drive& drive) {
    return drive.state() != DriveState::operation_enabled && drive.velocity_rad_s() == 0.0;
  });
}

}  // namespace mimesis::hw::sim
