#include "hw/sim/body/sim_body_node.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/model/files.h"
#include "hw/outside/recorded_can.h"
#include "hw/sim/body/body_messages_node.h"

namespace mimesis::hw::sim {
namespace {

constexpr double kTransformsRateHz = 50.0;
constexpr double kMotorAcceleration_rad_s2 =
    1e4;  // that the drives claim: the world has the motors
// A machine that is slower than the clock must not make steps ever longer.
constexpr double kLongestStep_s = 0.05;

std::vector<DriveConfig> configs(const SimBodyParams& p, const Joints& joints) {
  const std::vector<arm::Axis> axes = complete(p.axes, joints);
  std::vector<DriveConfig> drives;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    drives.push_back({.axis = axes[i],
                      .plant = {.v_max_rad_s = p.v_margin * joints.limits.v_max[k],
                                .a_max_rad_s2 = kMotorAcceleration_rad_s2},
                      .in_a_world = true,
                      .home_rad = joints.home[k],
                      .following_window_rad = p.following_window_rad,
                      .following_time_s = p.following_time_s});
  }
  return drives;
}

MotorFault motor_fault(const std::string& kind) {
  return kind == "off"      ? MotorFault::kOff
         : kind == "locked" ? MotorFault::kLocked
                            : MotorFault::kWeak;
}

bool is_motor_fault(const std::string& kind) {
  return kind == "off" || kind == "locked" || kind == "weak";
}

}  // namespace

SimBodyNode::SimBodyNode(const Params& params, runtime::Bus& bus)
    : params_(params),
      biped_(model::load_biped(params.robot)),
      joints_(load_joints(params.robot, kMotorAcceleration_rad_s2)),
      world_(biped_, model::urdf_of_biped(params.robot), body_options(params)),
      motors_(joints_.home.begin(), joints_.home.end()),
      troubles_(bus, "trouble"),
      judge_({.settle_s = params.settle_s, .time_limit_s = params.time_limit_s}, bus),
      sensors_(bus, "sensors"),
      truth_(bus, "truth"),
      arm_(bus, "arm"),
      drawer_state_(bus, "drawer"),
      transforms_(bus, "transforms") {
  for (const PushParams& p : params.pushes) {
    if (!p.link.empty()) biped_.tree.require_link(p.link);
    world_.push({.at_s = p.at_s,
                 .duration_s = p.duration_s,
                 .impulse_W_ns = {p.x_n_s, p.y_n_s, p.z_n_s},
                 .link = p.link});
  }
  if (params.drawer.present) {
    for (const robot::Side side : robot::kSides) {
      if (biped_.hand[side] < 0) {
        throw ConfigError("drawer.present: '" + biped_.tree.name() + "' has not two hands");
      }
    }
    drawer_.emplace(drawer_settings(params.drawer, biped_));
    gripper_ = {gripper_of(params.drawer.left_gripper, robot::kLeft),
                gripper_of(params.drawer.right_gripper, robot::kRight)};
  }
  for (const FaultParams& fault : params.faults) biped_.tree.require_joint(fault.joint);
  std::ranges::stable_sort(params_.faults, {}, &FaultParams::at_s);
  open_buses(bus);
}

void SimBodyNode::open_buses(runtime::Bus& bus) {
  const std::vector<DriveConfig> all = configs(params_, joints_);
  auto first = all.begin();
  for (const BusShare& share : complete(params_.buses, params_.can, joints_)) {
    const auto last = first + share.joints;
    racks_.push_back(
        std::make_unique<Rack>(std::vector(first, last), outside::open_can(share.can, bus)));
    for (Drive& drive : racks_.back()->drives()) drives_.push_back(&drive);
    first = last;
  }
  measure();
}

void SimBodyNode::make_trouble() {
  while (const auto trouble = troubles_.pop()) {
    const Eigen::Vector3d impulse(trouble->push_x_n_s(), trouble->push_y_n_s(),
                                  trouble->push_z_n_s());
    if (!impulse.isZero()) {
      world_.push({.at_s = world_.time_s(),
                   .duration_s = trouble->push_duration_s(),
                   .impulse_W_ns = impulse});
    }
    if (trouble->motor().empty()) continue;
    const int joint = biped_.tree.find_joint(trouble->motor());
    if (joint >= 0 && is_motor_fault(trouble->motor_fault())) {
      world_.fail(joint, motor_fault(trouble->motor_fault()));
    } else {
      runtime::warn("trouble: motor '{}', fault '{}': expected a joint and off, locked or weak",
                    trouble->motor(), trouble->motor_fault());
    }
  }
  for (; faults_made_ < params_.faults.size(); ++faults_made_) {
    const FaultParams& fault = params_.faults[faults_made_];
    if (world_.time_s() < fault.at_s - 1e-9) return;
    const int joint = biped_.tree.require_joint(fault.joint);
    runtime::info("trouble: {} {}", fault.joint, fault.kind);
    if (is_motor_fault(fault.kind)) {
      world_.fail(joint, motor_fault(fault.kind));
    } else {
      drives_[static_cast<std::size_t>(joint)]->inject(fault.kind == "mute" ? Trouble::mute
                                                                            : Trouble::overcurrent);
    }
  }
}

void SimBodyNode::measure() {
  const BodySensors& sensors = world_.sensors();
  for (std::size_t i = 0; i < drives_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    drives_[i]->world_joint().measure(sensors.q[k], sensors.dq[k], sensors.torque[k]);
  }
}

void SimBodyNode::move_world(runtime::Time now) {
  if (!last_) return;
  const double asked_s = runtime::to_seconds(now - *last_);
  const double duration_s = std::min(asked_s, kLongestStep_s);
  if (duration_s < asked_s && lags_.pass()) {
    runtime::warn("the simulation lags: {:.3f} s of graph time are left out", asked_s - duration_s);
  }
  for (std::size_t i = 0; i < drives_.size(); ++i) motors_[i] = drives_[i]->world_joint().motor();
  world_.step(motors_, duration_s);
  if (drawer_) move_drawer(duration_s);
  if (world_.trouble() != trouble_) runtime::warn("{}", trouble_ = world_.trouble());
}

robot::Biped::Gripper SimBodyNode::gripper_of(const GripperParams& params, robot::Side side) const {
  if (params.joint.empty()) return biped_.gripper[side];
  if (params.joint == "none") return {};
  return {biped_.tree.require_joint(params.joint), params.closed_rad};
}

bool SimBodyNode::closed(const robot::Biped::Gripper& gripper) const {
  if (gripper.dof < 0) return true;
  const double angle = world_.sensors().q[gripper.dof];
  return gripper.closed_rad < 0.0 ? angle < gripper.closed_rad : angle > gripper.closed_rad;
}

void SimBodyNode::move_drawer(double dt_s) {
  const DrawerHands hands{
      .p_W_m = world_.truth().hand_W_m,
      .grips = {closed(gripper_[robot::kLeft]), closed(gripper_[robot::kRight])}};
  const Eigen::Vector3d force_W_n = drawer_->step(world_.time_s(), dt_s, hands);
  world_.pull(biped_.hand[robot::kLeft], Eigen::Vector3d::Zero(), force_W_n);
}

void SimBodyNode::step(runtime::Time now) {
  make_trouble();
  for (const auto& rack : racks_) rack->move(now);
  move_world(now);
  last_ = now;
  measure();
  for (const auto& rack : racks_) rack->answer(now);
  judge_.step(now, world_.truth(), drawer_ ? &*drawer_ : nullptr);
  publish(now);
  ++steps_;
}

void SimBodyNode::publish(runtime::Time now) {
  to_proto(world_.sensors(), sensors_message_);
  sensors_.send(sensors_message_, now);
  to_proto(world_.truth(), world_.sensors().torque, truth_message_);
  truth_.send(truth_message_, now);

  arm_message_.Clear();
  bool operational = true;
  for (const Drive* drive : drives_) {
    arm_message_.add_position_rad(drive->position_rad());
    arm_message_.add_velocity_rad_s(drive->velocity_rad_s());
    arm_message_.add_torque_n_m(drive->torque_n_m());
    arm_message_.add_drives(static_cast<v1::DriveState>(drive->state()));
    operational = operational && drive->state() == DriveState::operation_enabled;
  }
  arm_message_.set_operational(operational);
  arm_.send(arm_message_, now);

  if (drawer_) {
    to_proto(drawer_->now(), world_.truth(), drawer_message_);
    drawer_state_.send(drawer_message_, now);
  }
  const auto every =
      static_cast<std::uint64_t>(std::max(1.0, std::round(params_.rate_hz / kTransformsRateHz)));
  if (steps_ % every != 0) return;
  foxglove::FrameTransforms transforms;
  *transforms.add_transforms() = to_transform(world_.truth().X_WB, biped_.tree.link(0).name);
  transforms_.send(transforms, now);
}

bool SimBodyNode::at_rest() const {
  return std::ranges::none_of(
      drives_, [](const Drive* drive) { return drive->state() == DriveState::operation_enabled; });
}

}  // namespace mimesis::hw::sim
