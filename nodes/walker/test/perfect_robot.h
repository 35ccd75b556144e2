#pragma once
#include <Eigen/Geometry>

#include "common/math/so3.h"
#include "common/robot/dynamics.h"
#include "nodes/walker/pattern/pattern.h"
#include "proto/bridge.pb.h"
#include "proto/walker.pb.h"

namespace mimesis::walker::testing {

/// An ideal robot that reaches its set-points within a tick: its loaded foot stands flat where the
/// walker plans it, and the ground gives the planned zero moment point.
class PerfectRobot {
 public:
  explicit PerfectRobot(const robot::Biped& biped)
      : q(biped.half_sitting), biped_(biped), kinematics_(biped.tree), last_q_(q) {
    zmp_W_m_.setZero();
    for (const Side side : robot::kSides) {
      foot_W_m_[side] = {0.0, robot::sign(side) * 0.5 * biped.feet_distance_m, 0.0};
    }
  }

  void obey(const v1::JointCommand& command) {
    for (Eigen::Index j = 0; j < q.size(); ++j) q[j] = command.position_rad(static_cast<int>(j));
  }
  void stand(const v1::WalkFeedback& plan) {
    for (int i = 0; i < plan.feet_size(); ++i) {
      const auto& p = plan.feet(i).position_in_world_m();
      const auto side = static_cast<std::size_t>(i);
      foot_W_m_[side] = {p.x_m(), p.y_m(), p.z_m()};
      yaw_rad_[side] = plan.feet(i).yaw_rad();
    }
    zmp_W_m_ = 0.5 * (foot_W_m_[0] + foot_W_m_[1]).head<2>();
  }
  void stand(const v1::WalkBalance& plan) {
    zmp_W_m_ = {plan.zmp_planned_in_world_m().x_m(), plan.zmp_planned_in_world_m().y_m()};
  }

  v1::JointState joints() {
    v1::JointState message;
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      message.add_position_rad(q[j]);
      message.add_velocity_rad_s((q[j] - last_q_[j]) / kTick_s);
      message.add_torque_n_m(0.0);
    }
    last_q_ = q;
    message.set_operational(operational);
    return message;
  }

  v1::BodySensors sensors() {
    v1::BodySensors message;
    const double left = left_share();
    const Side stance = left >= 0.5 ? kLeft : kRight;
    kinematics_.update(Eigen::Isometry3d::Identity(), q);
    const Eigen::Matrix3d R_BS = kinematics_.X_WL(biped_.leg[stance].sole).linear();
    const Eigen::Matrix3d R_BI = kinematics_.X_WL(biped_.imu).linear();
    const Eigen::Matrix3d R_WI =
        tilt.toRotationMatrix() * yaw(yaw_rad_[stance]) * R_BS.transpose() * R_BI;
    const Eigen::Quaterniond attitude(R_WI);
    message.mutable_world_from_imu()->set_w(attitude.w());
    message.mutable_world_from_imu()->set_x(attitude.x());
    message.mutable_world_from_imu()->set_y(attitude.y());
    message.mutable_world_from_imu()->set_z(attitude.z());
    const Eigen::Vector3d turn_I = math::log_so3(Eigen::Matrix3d(R_WI_.transpose() * R_WI));
    R_WI_ = R_WI;
    message.mutable_gyro_in_imu()->set_x_rad_s(turn_I.x() / kTick_s);
    message.mutable_gyro_in_imu()->set_y_rad_s(turn_I.y() / kTick_s);
    message.mutable_gyro_in_imu()->set_z_rad_s(turn_I.z() / kTick_s);
    const Eigen::Vector3d up_I = R_WI.transpose() * Eigen::Vector3d(0.0, 0.0, robot::kGravity);
    message.mutable_specific_force_in_imu()->set_x_m_s2(up_I.x());
    message.mutable_specific_force_in_imu()->set_y_m_s2(up_I.y());
    message.mutable_specific_force_in_imu()->set_z_m_s2(up_I.z());
    const double weight_n = biped_.tree.mass_kg() * robot::kGravity;
    for (const Side side : robot::kSides) {
      v1::FootWrench& foot = *message.add_feet();
      foot.set_foot(side == kLeft ? v1::FOOT_LEFT : v1::FOOT_RIGHT);
      const double f_n = weight_n * load_share * (side == kLeft ? left : 1.0 - left);
      const Eigen::Vector2d cop_S = centre_of_pressure(side, left);
      foot.set_force_z_n(f_n);
      foot.set_moment_x_n_m(cop_S.y() * f_n);
      foot.set_moment_y_n_m(-cop_S.x() * f_n);
    }
    return message;
  }

  Eigen::VectorXd q;
  bool operational = true;
  double load_share = 1.0;  ///< share of the weight on the feet: 0 in the air
  Eigen::Quaterniond tilt = Eigen::Quaterniond::Identity();

 private:
  static Eigen::Matrix3d yaw(double rad) {
    return Eigen::AngleAxisd(rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  }
  bool in_air(Side side) const { return foot_W_m_[side].z() > 1e-4; }
  double left_share() const {
    if (in_air(kLeft)) return 0.0;
    if (in_air(kRight)) return 1.0;
    const Eigen::Vector2d r = foot_W_m_[kRight].head<2>(), l = foot_W_m_[kLeft].head<2>();
    return std::clamp((zmp_W_m_ - r).dot(l - r) / (l - r).squaredNorm(), 0.0, 1.0);
  }
  Eigen::Vector2d centre_of_pressure(Side side, double left) const {
    const Eigen::Vector2d r = foot_W_m_[kRight].head<2>(), l = foot_W_m_[kLeft].head<2>();
    const Eigen::Vector2d off = zmp_W_m_ - (r + left * (l - r));
    return Eigen::Rotation2Dd(-yaw_rad_[side]) * off;
  }

  const robot::Biped& biped_;
  robot::Kinematics kinematics_;
  Eigen::VectorXd last_q_;
  std::array<Eigen::Vector3d, 2> foot_W_m_;
  std::array<double, 2> yaw_rad_{};
  Eigen::Vector2d zmp_W_m_;
  Eigen::Matrix3d R_WI_ = Eigen::Matrix3d::Identity();  ///< of the last reading
};

}  // namespace mimesis::walker::testing
