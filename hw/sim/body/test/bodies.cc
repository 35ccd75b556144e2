#include "hw/sim/body/test/bodies.h"

#include "common/robot/kinematics.h"

namespace mimesis::hw::sim {
namespace {
constexpr double kDegree = 3.14159265358979323846 / 180.0;
}

robot::Biped hrp2_like() {
  robot::Biped biped{robot::read_urdf(biped_urdf()), {}, {-1, -1}, -1, -1, {}, {}, {}};
  const auto& tree = biped.tree;
  biped.half_sitting = Eigen::VectorXd::Zero(tree.dof());
  const auto set = [&](const std::string& joint, double degrees) {
    biped.half_sitting[tree.require_joint(joint)] = degrees * kDegree;
  };
  for (const robot::Side side : robot::kSides) {
    const std::string p = side == robot::kLeft ? "left_" : "right_";
    auto& leg = biped.leg[side];
    leg.sole = tree.require_link(p + "sole");
    leg.foot = tree.require_link(p + "foot");
    const char* joints[] = {"hip_yaw", "hip_roll",    "hip_pitch",
                            "knee",    "ankle_pitch", "ankle_roll"};
    for (std::size_t i = 0; i < 6; ++i) leg.dof[i] = tree.require_joint(p + joints[i]);
    leg.ankle_S_m = {0.0, 0.0, 0.105};
    leg.min_S_m = {-0.100, side == robot::kLeft ? -0.056 : -0.075};
    leg.max_S_m = {0.130, side == robot::kLeft ? 0.075 : 0.056};
    biped.hand[side] = tree.require_link(p + "grip");
    set(p + "hip_pitch", -26.0);
    set(p + "knee", 50.0);
    set(p + "ankle_pitch", -24.0);
    set(p + "shoulder_pitch", 15.0);
    set(p + "shoulder_roll", robot::sign(side) * 10.0);
    set(p + "elbow", -30.0);
    set(p + "gripper", -robot::sign(side) * 10.0);
  }
  biped.trunk = tree.require_link("chest");
  biped.imu = tree.require_link("pelvis");
  robot::Kinematics kinematics(tree);
  kinematics.update(Eigen::Isometry3d::Identity(), biped.half_sitting);
  const Eigen::Vector3d left = kinematics.X_WL(biped.leg[0].sole).translation();
  const Eigen::Vector3d right = kinematics.X_WL(biped.leg[1].sole).translation();
  biped.feet_distance_m = left.y() - right.y();
  biped.X_WB_half_sitting = Eigen::Translation3d(-0.5 * (left + right));
  kinematics.update(biped.X_WB_half_sitting, biped.half_sitting);
  biped.com_height_m = kinematics.com().z();
  return biped;
}

}  // namespace mimesis::hw::sim
