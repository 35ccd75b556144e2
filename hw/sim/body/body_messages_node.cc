#include "hw/sim/body/body_messages_node.h"

#include "common/math/so3.h"

namespace mimesis::hw::sim {
namespace {

constexpr std::array kFeet = {v1::FOOT_LEFT, v1::FOOT_RIGHT};

void set(v1::Vector3* out, const Eigen::Vector3d& p_m) {
  out->set_x_m(p_m.x());
  out->set_y_m(p_m.y());
  out->set_z_m(p_m.z());
}

void set(v1::Quaternion* out, const Eigen::Quaterniond& R) {
  out->set_w(R.w());
  out->set_x(R.x());
  out->set_y(R.y());
  out->set_z(R.z());
}

}  // namespace

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

void to_proto(const BodyTruth& truth, const Eigen::VectorXd& torque_n_m, v1::BodyTruth& out) {
  set(out.mutable_position_pelvis_in_world_m(), truth.X_WB.translation());
  set(out.mutable_world_from_pelvis(), Eigen::Quaterniond(truth.X_WB.linear()));
  set(out.mutable_com_in_world_m(), truth.com_W_m);
  auto* velocity = out.mutable_com_velocity_in_world();
  velocity->set_x_m_s(truth.com_v_W.x());
  velocity->set_y_m_s(truth.com_v_W.y());
  velocity->set_z_m_s(truth.com_v_W.z());
  set(out.mutable_zmp_in_world_m(), {truth.zmp_W_m.x(), truth.zmp_W_m.y(), 0.0});
  out.clear_feet();
  out.clear_normal_n();
  out.clear_ankle_pitch_n_m();
  out.clear_hands_in_world_m();
  for (std::size_t i = 0; i < kFeet.size(); ++i) {
    const Eigen::Isometry3d& X_WS = truth.X_WS[i];
    v1::Footprint* foot = out.add_feet();
    foot->set_foot(kFeet[i]);
    set(foot->mutable_position_in_world_m(), X_WS.translation());
    foot->set_yaw_rad(math::yaw_of(X_WS.linear()));
    out.add_normal_n(truth.normal_n[i]);
    out.add_ankle_pitch_n_m(truth.ankle_pitch_n_m[i]);
    set(out.add_hands_in_world_m(), truth.hand_W_m[i]);
  }
  out.mutable_torque_n_m()->Assign(torque_n_m.begin(), torque_n_m.end());
  out.set_fell(truth.fell);
  out.set_how(truth.how);
}

void to_proto(const DrawerNow& drawer, const BodyTruth& truth, v1::DrawerState& out) {
  set(out.mutable_front_in_world_m(), drawer.front_W_m);
  set(out.mutable_handle_in_world_m(), drawer.handle_W_m);
  set(out.mutable_object_in_world_m(), drawer.object_W_m);
  out.set_opened_m(drawer.opened_m);
  out.set_held(drawer.held);
  out.set_taken(drawer.taken);
  out.clear_hands_in_world_m();
  for (const Eigen::Vector3d& hand : truth.hand_W_m) set(out.add_hands_in_world_m(), hand);
}

foxglove::FrameTransform to_transform(const Eigen::Isometry3d& X_WB, const std::string& child) {
  foxglove::FrameTransform out;
  out.set_parent_frame_id("world");
  out.set_child_frame_id(child);
  out.mutable_translation()->set_x(X_WB.translation().x());
  out.mutable_translation()->set_y(X_WB.translation().y());
  out.mutable_translation()->set_z(X_WB.translation().z());
  const Eigen::Quaterniond R(X_WB.linear());
  out.mutable_rotation()->set_x(R.x());
  out.mutable_rotation()->set_y(R.y());
  out.mutable_rotation()->set_z(R.z());
  out.mutable_rotation()->set_w(R.w());
  return out;
}

}  // namespace mimesis::hw::sim
