#include "hw/sim/udp/udp_node.h"

#include <random>

#include "common/model/files.h"

namespace mimesis::hw::sim {

double UdpParams::robot_rate_hz() const { return model::rate_of_robot(robot); }

UdpNode::UdpNode(const Params& params, runtime::Bus& bus)
    : endpoint_(params.address, bus, params.robot), joints_(bus, "joint_states") {
  const kin::ArmModel model = model::load_arm(params.robot);
  const auto list = [](const Eigen::VectorXd& v) {
    return std::vector<double>(v.data(), v.data() + v.size());
  };
  const auto session = runtime::read_outside_value<std::uint32_t>(
      bus, "udp", [&] { return bus.lockstep() ? 2u : std::random_device{}() | 1u; });
  controller_.emplace(ControllerConfig{.home_rad = list(model.home),
                                       .v_max_rad_s = list(model.v_max),
                                       .a_max_rad_s2 = list(model.a_max),
                                       .session = session});
}

void UdpNode::step(runtime::Time now) {
  for (const auto& [from, bytes] : endpoint_.receive()) controller_->handle(from, bytes, now);
  controller_->advance(now);
  if (!controller_->master().empty()) endpoint_.send(controller_->master(), controller_->state());
  v1::JointState state;
  const bool follows = controller_->follows();
  for (std::size_t i = 0; i < controller_->position_rad().size(); ++i) {
    state.add_position_rad(controller_->position_rad()[i]);
    state.add_velocity_rad_s(controller_->velocity_rad_s()[i]);
    state.add_torque_n_m(0.0);
    state.add_drives(follows ? v1::DRIVE_STATE_OPERATION_ENABLED
                             : v1::DRIVE_STATE_SWITCH_ON_DISABLED);
  }
  state.set_operational(follows);
  joints_.send(state, now);
}

}  // namespace mimesis::hw::sim
