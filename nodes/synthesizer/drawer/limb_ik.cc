#include "nodes/synthesizer/drawer/limb_ik.h"

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"

namespace mimesis::synthesizer {
namespace {

struct TwoLinks {
  Eigen::Vector3d upper, lower;  // unit directions
  Eigen::Vector3d normal;        // of their plane: straight direction × bend direction
  double bend_rad;               // between them
  double short_by_m;
};

// A triangle of sides a, b and the way to the target; the middle joint lies on the side of `bend`.
TwoLinks two_links(double a, double b, const Eigen::Vector3d& to_target,
                   const Eigen::Vector3d& bend) {
  const double far = to_target.norm(), reach = a + b;
  const double c = std::clamp(far, std::abs(a - b) + 1e-6, reach);
  const Eigen::Vector3d along = to_target / far;
  const Eigen::Vector3d across = (bend - bend.dot(along) * along).normalized();
  const double at_root = std::acos(std::clamp((a * a + c * c - b * b) / (2.0 * a * c), -1.0, 1.0));
  const double at_tip = std::acos(std::clamp((b * b + c * c - a * a) / (2.0 * b * c), -1.0, 1.0));
  return {.upper = std::cos(at_root) * along + std::sin(at_root) * across,
          .lower = std::cos(at_tip) * along - std::sin(at_tip) * across,
          .normal = along.cross(across),
          .bend_rad = at_root + at_tip,
          .short_by_m = std::max(0.0, far - reach)};
}

Eigen::Matrix3d frame_of(const Eigen::Vector3d& y, const Eigen::Vector3d& z) {
  Eigen::Matrix3d R;
  R << y.cross(z), y, z;
  return R;
}

double sum_y(const mocap::Body& body, mocap::BodyJoint wrist, mocap::Side side) {
  return std::abs(body.offset_m[wrist].y() + body.hand_m[side].y());
}

}  // namespace

Eigen::Matrix3d foot_rotation(const FootPose& foot) {
  return math::exp_so3({0.0, 0.0, foot.yaw_rad}) * math::exp_so3({0.0, foot.pitch_rad, 0.0});
}

LimbAngles leg_angles(const mocap::Body& body, mocap::Side side, const Eigen::Matrix3d& R_W_root,
                      const Eigen::Vector3d& p_W_root, const Eigen::Vector3d& p_W_ankle,
                      const Eigen::Matrix3d& R_W_foot) {
  const bool left = side == mocap::kLeft;
  const auto& hip = body.offset_m[left ? mocap::kLeftHip : mocap::kRightHip];
  const double thigh = body.offset_m[left ? mocap::kLeftKnee : mocap::kRightKnee].norm();
  const double shank = body.offset_m[left ? mocap::kLeftAnkle : mocap::kRightAnkle].norm();
  // the foot's x without its pitch, which may be large: across y
  const Eigen::Vector3d toes = R_W_foot.col(1).cross(Eigen::Vector3d::UnitZ()).normalized();
  const TwoLinks leg =
      two_links(thigh, shank, p_W_ankle - p_W_root - R_W_root * hip, R_W_root.col(0) + toes);
  // bend × straight is the knee's axis: a knee that bends forward lets the shank lag
  const Eigen::Matrix3d R_W_thigh = frame_of(-leg.normal, -leg.upper);
  const Eigen::Vector3d knee(0.0, leg.bend_rad, 0.0);
  const Eigen::Matrix3d R_W_shank = R_W_thigh * math::exp_so3(knee);
  return {.axis_angle_rad = {math::log_so3(R_W_root.transpose() * R_W_thigh), knee,
                             math::log_so3(R_W_shank.transpose() * R_W_foot)},
          .short_by_m = leg.short_by_m};
}

LimbAngles arm_angles(const mocap::Body& body, mocap::Side side, const Eigen::Matrix3d& R_W_chest,
                      const Eigen::Vector3d& p_W_shoulder, const Eigen::Vector3d& p_W_hand,
                      const Eigen::Vector3d& elbow_W) {
  const bool left = side == mocap::kLeft;
  const double sign = left ? 1.0 : -1.0;
  const double upper = body.offset_m[left ? mocap::kLeftElbow : mocap::kRightElbow].norm();
  const double lower = sum_y(body, left ? mocap::kLeftWrist : mocap::kRightWrist, side);
  const TwoLinks arm = two_links(upper, lower, p_W_hand - p_W_shoulder, elbow_W);
  const Eigen::Matrix3d R_W_upper = frame_of(sign * arm.upper, sign * arm.normal);
  return {
      .axis_angle_rad = {math::log_so3(R_W_chest.transpose() * R_W_upper),
                         Eigen::Vector3d(0.0, 0.0, -sign * arm.bend_rad), Eigen::Vector3d::Zero()},
      .short_by_m = arm.short_by_m};
}

}  // namespace mimesis::synthesizer
