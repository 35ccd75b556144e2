#include "hw/sim/powercube/powercube_node.h"

#include "common/model/files.h"
#include "hw/outside/recorded.h"

namespace mimesis::hw::sim {
namespace {

constexpr std::uint32_t kErrorBit = 0x1, kHaltedBit = 0x4;

v1::DriveState drive_state(std::uint32_t state) {
  if ((state & kErrorBit) != 0) return v1::DRIVE_STATE_FAULT;
  return (state & kHaltedBit) != 0 ? v1::DRIVE_STATE_SWITCH_ON_DISABLED
                                   : v1::DRIVE_STATE_OPERATION_ENABLED;
}

}  // namespace

double PowercubeParams::robot_rate_hz() const { return model::rate_of_robot(robot); }

PowercubeNode::PowercubeNode(const Params& params, runtime::Bus& bus)
    : bus_(outside::open_can(params.bus, bus)), inbox_(256), arm_(bus, "joint_states") {
  const kin::ArmModel model = model::load_arm(params.robot);
  axes_ = cia402::complete(params.axes, model.dof());
  for (Eigen::Index i = 0; i < model.dof(); ++i) {
    const cia402::Axis& axis = axes_[static_cast<std::size_t>(i)];
    modules_.emplace_back(
        ModuleConfig{.module = axis.node_id,
                     .position_rad = axis.sign * (model.home[i] - axis.offset_rad),
                     .homed = params.homed,
                     .v_max_rad_s = params.v_margin * model.v_max[i],
                     .deceleration_rad_s2 = model.a_max[i],
                     .watchdog = runtime::from_seconds(params.watchdog_s)});
  }
}

void PowercubeNode::step(runtime::Time now) {
  const std::size_t count = bus_->receive(inbox_);
  outbox_.clear();
  v1::JointState state;
  bool operational = true;
  for (std::size_t i = 0; i < modules_.size(); ++i) {
    Module& module = modules_[i];
    module.advance(now);
    for (const can::Frame& frame : std::span(inbox_).first(count)) module.handle(frame, outbox_);
    state.add_position_rad(axes_[i].sign * module.position_rad() + axes_[i].offset_rad);
    state.add_velocity_rad_s(axes_[i].sign * module.velocity_rad_s());
    state.add_torque_n_m(0.0);
    state.add_drives(drive_state(module.state()));
    operational = operational && drive_state(module.state()) == v1::DRIVE_STATE_OPERATION_ENABLED;
  }
  if (!outbox_.empty()) bus_->send(outbox_);
  state.set_operational(operational);
  arm_.send(state, now);
}

}  // namespace mimesis::hw::sim
