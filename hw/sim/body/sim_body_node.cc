#include "hw/sim/body/sim_body_node.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/math/so3.h"
#include "common/model/drawing.h"
#include "common/model/files.h"
#include "common/model/messages.h"
#include "hw/outside/recorded.h"

namespace mimesis::hw::sim {
namespace {

constexpr std::array kFeet = {v1::FOOT_LEFT, v1::FOOT_RIGHT};

using model::to_proto;

void set(v1::Quaternion* out, const Eigen::Quaterniond& R) {
  out->set_w(R.w());
  out->set_x(R.x());
  out->set_y(R.y());
  out->set_z(R.z());
}

void to_proto(const BodySensors& sensors, v1::BodySensors& out) {
  set(out.mutable_world_from_imu(), sensors.R_WI);
  auto* gyro = out.mutable_gyro_in_imu();
  gyro->set_x_rad_s(sensors.gyro_I.x());
  gyro->set_y_rad_s(sensors.gyro_I.y());
  gyro->set_z_rad_s(sensors.gyro_I.z());
  auto* force = out.mutable_specific_force_in_imu();
  force->set_x_m_s2(sensors.specific_force_I.x());
  force->set_y_m_s2(sensors.specific_force_I.y());
  force->set_z_m_s2(sensors.specific_force_I.z());
  out.clear_feet();
  for (std::size_t i = 0; i < kFeet.size(); ++i) {
    const robot::Wrench& wrench = sensors.foot_S[i];
    v1::FootWrench* foot = out.add_feet();
    foot->set_foot(kFeet[i]);
    foot->set_force_x_n(wrench.force.x());
    foot->set_force_y_n(wrench.force.y());
    foot->set_force_z_n(wrench.force.z());
    foot->set_moment_x_n_m(wrench.moment.x());
    foot->set_moment_y_n_m(wrench.moment.y());
    foot->set_moment_z_n_m(wrench.moment.z());
  }
}

void to_proto(const Collisions& collisions, v1::BodyCollisions& out) {
  out.set_steps(static_cast<std::uint64_t>(collisions.steps));
  out.set_deepest_m(collisions.deepest_m);
  out.set_deepest_between(collisions.deepest_between);
}

void to_proto(const BodyTruth& truth, v1::BodyTruth& out) {
  to_proto(truth.X_WB.translation(), *out.mutable_position_pelvis_in_world_m());
  set(out.mutable_world_from_pelvis(), Eigen::Quaterniond(truth.X_WB.linear()));
  to_proto(truth.com_W_m, *out.mutable_com_in_world_m());
  auto* velocity = out.mutable_com_velocity_in_world();
  velocity->set_x_m_s(truth.com_v_W.x());
  velocity->set_y_m_s(truth.com_v_W.y());
  velocity->set_z_m_s(truth.com_v_W.z());
  to_proto({truth.zmp_W_m.x(), truth.zmp_W_m.y(), 0.0}, *out.mutable_zmp_in_world_m());
  out.clear_feet();
  out.clear_normal_n();
  out.clear_ankle_pitch_n_m();
  out.clear_hands_in_world_m();
  for (std::size_t i = 0; i < kFeet.size(); ++i) {
    const Eigen::Isometry3d& X_WS = truth.X_WS[i];
    v1::Footprint* foot = out.add_feet();
    foot->set_foot(kFeet[i]);
    to_proto(X_WS.translation(), *foot->mutable_position_in_world_m());
    foot->set_yaw_rad(math::yaw_of(X_WS.linear()));
    out.add_normal_n(truth.normal_n[i]);
    out.add_ankle_pitch_n_m(truth.ankle_pitch_n_m[i]);
    to_proto(truth.hand_W_m[i], *out.add_hands_in_world_m());
  }
  out.set_fell(truth.fell);
  out.set_how(truth.how);
  if (truth.self.steps > 0) to_proto(truth.self, *out.mutable_self_collisions());
  if (truth.furniture.steps > 0) to_proto(truth.furniture, *out.mutable_furniture_collisions());
}

void to_proto(const DrawerNow& drawer, v1::DrawerState& out) {
  to_proto(drawer.front_W_m, *out.mutable_front_in_world_m());
  out.set_opened_m(drawer.opened_m);
  out.set_held(drawer.held);
  out.set_taken(drawer.taken);
}

constexpr double kTransformsRateHz = 25.0;
constexpr double kMotorAcceleration_rad_s2 = 1e4;  // claim of the drives: the world has the motors
// A machine that is slower than the clock must not make steps ever longer.
constexpr double kLongestStep_s = 0.05;

std::vector<DriveConfig> configs(const SimBodyParams& p, const Joints& joints) {
  const std::vector<cia402::Axis> axes = complete(p.axes, joints);
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
  return kind == "off" ? MotorFault::off : kind == "locked" ? MotorFault::locked : MotorFault::weak;
}

bool is_motor_fault(const std::string& kind) {
  return kind == "off" || kind == "locked" || kind == "weak";
}

using Eigen::Vector3d;
using model::Rgba;

constexpr Rgba kTrunk{0.62, 0.65, 0.69, 1.0}, kLeft{0.25, 0.49, 0.75, 1.0},
    kRight{0.84, 0.41, 0.26, 1.0}, kSole{0.24, 0.25, 0.27, 1.0}, kWood{0.77, 0.64, 0.49, 1.0},
    kFront{0.87, 0.75, 0.59, 1.0}, kHandle{0.28, 0.28, 0.3, 1.0}, kObject{0.77, 0.24, 0.35, 1.0},
    kForce{0.95, 0.75, 0.2, 1.0}, kCom{0.95, 0.95, 0.95, 1.0}, kZmp{0.9, 0.15, 0.3, 1.0};

Rgba colour_of(const robot::LinkShape& shape) {
  if (shape.sole) return kSole;
  return shape.part == robot::BodyPart::left    ? kLeft
         : shape.part == robot::BodyPart::right ? kRight
                                                : kTrunk;
}

Eigen::Isometry3d at(const Vector3d& p) { return Eigen::Isometry3d(Eigen::Translation3d(p)); }

}  // namespace

BodyDrawing::BodyDrawing(const robot::Biped& biped, const std::string& urdf_file,
                         const std::optional<DrawerSettings>& drawer)
    : biped_(biped),
      kinematics_(biped_.tree),
      shapes_(robot::link_shapes(biped, urdf_file)),
      drawn_{0},
      drawer_(drawer) {
  for (const robot::LinkShape& shape : shapes_) {
    if (std::ranges::find(drawn_, shape.link) == drawn_.end()) drawn_.push_back(shape.link);
  }
}

foxglove::SceneUpdate BodyDrawing::shapes(std::chrono::nanoseconds now) const {
  foxglove::SceneUpdate update;
  for (const int link : drawn_) {
    const std::string& frame = biped_.tree.link(link).name;
    foxglove::SceneEntity& entity = model::add_entity(update, frame, frame, now);
    for (const robot::LinkShape& shape : shapes_) {
      if (shape.link != link) continue;
      const Vector3d middle = shape.X_LP.translation();
      const Vector3d half = 0.5 * shape.length_m * shape.X_LP.linear().col(2);
      if (shape.radius_m == 0.0) {
        model::add_box(entity, shape.X_LP, shape.edges_m, colour_of(shape));
      } else if (shape.length_m == 0.0) {
        model::add_ball(entity, middle, shape.radius_m, colour_of(shape));
      } else {
        model::add_rod(entity, middle - half, middle + half, shape.radius_m, colour_of(shape));
      }
    }
  }
  if (!drawer_) return update;
  foxglove::SceneEntity& cabinet = model::add_entity(update, "cabinet", "cabinet", now);
  foxglove::SceneEntity& drawer = model::add_entity(update, "drawer", "drawer", now);
  for (const Board& board : boards(*drawer_)) {
    model::add_box(board.moves ? drawer : cabinet, at(0.5 * (board.low_m + board.high_m)),
                   board.high_m - board.low_m,
                   board.handle  ? kHandle
                   : board.moves ? kFront
                                 : kWood);
  }
  model::add_ball(model::add_entity(update, "drawer_object", "drawer_object", now),
                  Vector3d::Zero(), 0.035, kObject);
  return update;
}

foxglove::FrameTransforms BodyDrawing::frames(const BodyTruth& truth, const Eigen::VectorXd& q,
                                              const DrawerNow* drawer,
                                              std::chrono::nanoseconds now) {
  foxglove::FrameTransforms frames;
  kinematics_.update(truth.X_WB, q);
  for (const int link : drawn_)
    model::add_frame(frames, "world", biped_.tree.link(link).name, kinematics_.X_WL(link), now);
  if (drawer != nullptr && drawer_) {
    Eigen::Isometry3d X_WD = at(drawer->front_W_m);
    X_WD.linear() = Eigen::AngleAxisd(drawer_->yaw_rad, Vector3d::UnitZ()).toRotationMatrix();
    model::add_frame(frames, "world", "cabinet", X_WD, now);
    X_WD.translation() -= drawer->opened_m * X_WD.linear().col(0);
    model::add_frame(frames, "world", "drawer", X_WD, now);
    model::add_frame(frames, "world", "drawer_object", at(drawer->object_W_m), now);
  }
  for (foxglove::FrameTransform& frame : *frames.mutable_transforms())
    frame.clear_timestamp();  // logs have it on the message alone
  return frames;
}

foxglove::SceneUpdate BodyDrawing::forces(const BodyTruth& truth, std::chrono::nanoseconds now) {
  constexpr double kLength_m_n = 1e-3, kLeast_n = 5.0, kThick_m = 0.012;
  foxglove::SceneUpdate update;
  foxglove::SceneEntity& entity = model::add_entity(update, "forces", "world", now);
  for (const robot::Side side : robot::kSides) {
    if (truth.normal_n[side] < kLeast_n) continue;
    const Vector3d foot = truth.X_WS[side].translation();
    model::add_rod(entity, foot, foot + kLength_m_n * truth.normal_n[side] * Vector3d::UnitZ(),
                   kThick_m, kForce);
  }
  model::add_ball(entity, truth.com_W_m, 0.04, kCom);
  const Vector3d below(truth.com_W_m.x(), truth.com_W_m.y(), 0.0);
  model::add_rod(entity, below, truth.com_W_m, 0.004, kCom);
  model::add_ball(entity, {truth.zmp_W_m.x(), truth.zmp_W_m.y(), 0.0}, 0.03, kZmp);
  return update;
}

SimBodyNode::SimBodyNode(const Params& params, runtime::Bus& bus)
    : params_(params),
      biped_(model::load_biped(params.robot)),
      joints_(load_joints(params.robot)),
      world_(biped_, model::urdf_of_biped(params.robot), body_options(params, biped_)),
      drawing_(biped_, model::urdf_of_biped(params.robot), body_options(params, biped_).drawer),
      motors_(joints_.home.begin(), joints_.home.end()),
      troubles_(bus, "trouble", true),
      judge_({.settle_s = params.settle_s, .time_limit_s = params.time_limit_s}, bus),
      sensors_(bus, "sensors"),
      truth_(bus, "truth"),
      joint_states_(bus, "joint_states"),
      drawer_state_(bus, "drawer"),
      sight_(bus, "sight"),
      touch_(bus, "touch"),
      entities_(bus, "entities", {.latched = true}),
      forces_(bus, "forces", {.latched = true}),
      transforms_(bus, "transforms", {.latched = true}) {
  for (const Push& push : params.pushes) world_.push(push);
  if (params.drawer.present) {
    for (const robot::Side side : robot::kSides) {
      if (biped_.hand[side] < 0) {
        throw ConfigError("drawer.present: '" + biped_.tree.name() + "' has not two hands");
      }
    }
    drawer_.emplace(*body_options(params, biped_).drawer);
    if (biped_.head >= 0) {
      HeadCameraSettings camera = params.camera;
      camera.seed = static_cast<std::uint64_t>(params.seed);
      camera_.emplace(camera);
    }
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
    std::vector<cia402::Axis> axes;
    for (auto drive = first; drive != last; ++drive) axes.push_back(drive->axis);
    racks_.push_back(std::make_unique<Rack>(
        std::vector(first, last),
        outside::open_can(share.can, bus, "drives", text_of(params_.robot, axes))));
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
  world_.move(*drawer_, {closed(gripper_[robot::kLeft]), closed(gripper_[robot::kRight])}, dt_s);
}

/// What of the drawer the robot can know: what its camera sees and what its fingers feel.
void SimBodyNode::see_drawer(runtime::Time now) {
  const DrawerNow& drawer = drawer_->now();
  touch_message_.set_left_holds(drawer.held);
  touch_message_.set_right_holds(drawer.taken);
  touch_.send(touch_message_, now);
  if (!camera_) return;
  const BodyTruth& truth = world_.truth();
  const double now_s = runtime::to_seconds(now);
  camera_->look(now_s, {truth.X_WH, drawer.handle_W_m, drawer.object_W_m, truth.hand_W_m});
  while (const HeadSight* sight = camera_->arrived(now_s)) {
    sight_message_.Clear();
    if (sight->handle_H_m) to_proto(*sight->handle_H_m, *sight_message_.mutable_handle_in_head_m());
    if (sight->object_H_m) to_proto(*sight->object_H_m, *sight_message_.mutable_object_in_head_m());
    sight_.send(sight_message_, runtime::from_seconds(sight->taken_s));
  }
}

void SimBodyNode::step(runtime::Time now) {
  make_trouble();
  for (const auto& rack : racks_) rack->move(now);
  move_world(now);
  last_ = now;
  measure();
  for (const auto& rack : racks_) rack->answer();
  judge_.step(now, world_.truth(), drawer_ ? &*drawer_ : nullptr);
  publish(now);
  ++steps_;
}

void SimBodyNode::publish(runtime::Time now) {
  to_proto(world_.sensors(), sensors_message_);
  sensors_.send(sensors_message_, now);
  to_proto(world_.truth(), truth_message_);
  truth_.send(truth_message_, now);

  joint_states_message_.Clear();
  bool operational = true;
  for (const Drive* drive : drives_) {
    joint_states_message_.add_position_rad(drive->position_rad());
    joint_states_message_.add_velocity_rad_s(drive->velocity_rad_s());
    joint_states_message_.add_torque_n_m(drive->torque_n_m());
    joint_states_message_.add_drives(static_cast<v1::DriveState>(drive->state()));
    operational = operational && drive->state() == DriveState::operation_enabled;
  }
  joint_states_message_.set_operational(operational);
  joint_states_.send(joint_states_message_, now);

  if (drawer_) {
    to_proto(drawer_->now(), drawer_message_);
    drawer_state_.send(drawer_message_, now);
    see_drawer(now);
  }
  const auto every =
      static_cast<std::uint64_t>(std::max(1.0, std::round(params_.rate_hz / kTransformsRateHz)));
  if (steps_ % every != 0) return;
  if (steps_ == 0) {
    auto shapes = drawing_.shapes(now);
    entities_.send(shapes, now);
  }
  auto frames =
      drawing_.frames(world_.truth(), world_.sensors().q, drawer_ ? &drawer_->now() : nullptr, now);
  transforms_.send(frames, now);
  auto forces = drawing_.forces(world_.truth(), now);
  forces_.send(forces, now);
}

bool SimBodyNode::at_rest() const {
  return std::ranges::none_of(
      drives_, [](const Drive* drive) { return drive->state() == DriveState::operation_enabled; });
}

}  // namespace mimesis::hw::sim
