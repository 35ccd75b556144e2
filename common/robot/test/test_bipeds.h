#pragma once
#include <filesystem>
#include <numbers>
#include <optional>
#include <random>

#include "common/math/so3.h"
#include "common/robot/biped.h"
#include "common/robot/dynamics.h"
#include "common/shared_data.h"

namespace mimesis::robot {

inline constexpr double kDegree = std::numbers::pi / 180.0;

/// models/biped.urdf, legs half-sitting as in models/biped.yaml.
inline BipedNames hrp2_names() {
  BipedNames names{.sole = {"left_sole", "right_sole"},
                   .hand = {"left_grip", "right_grip"},
                   .trunk = "chest",
                   .imu = "pelvis",
                   .sole_back_m = -0.1,
                   .sole_front_m = 0.13,
                   .sole_inner_m = 0.056,
                   .sole_outer_m = 0.075,
                   .half_sitting = {}};
  for (const std::string side : {"left_", "right_"}) {
    names.half_sitting.emplace_back(side + "hip_pitch", -26.0 * kDegree);
    names.half_sitting.emplace_back(side + "knee", 50.0 * kDegree);
    names.half_sitting.emplace_back(side + "ankle_pitch", -24.0 * kDegree);
  }
  return names;
}
inline Biped hrp2_like() {
  return make_biped(read_urdf(std::string(MIMESIS_SOURCE_DIR) + "/models/biped.urdf"),
                    hrp2_names());
}

/// JVRC-1, or nothing without the shared folder.
inline std::optional<Biped> jvrc1() {
  const std::string file = shared_data("data/robots/jvrc1.urdf").string();
  if (!std::filesystem::exists(file)) return {};
  BipedNames names{.sole = {"rfsensor", "lfsensor"},  // in the ankles
                   .hand = {},
                   .trunk = "WAIST_R_S",
                   .imu = "gyrometer",
                   .sole_back_m = -0.1,
                   .sole_front_m = 0.1,
                   .sole_inner_m = 0.05,
                   .sole_outer_m = 0.05,
                   .half_sitting = {}};
  std::swap(names.sole[0], names.sole[1]);
  for (const std::string side : {"L_", "R_"}) {
    names.half_sitting.emplace_back(side + "HIP_P", -0.363);
    names.half_sitting.emplace_back(side + "KNEE", 0.8);
    names.half_sitting.emplace_back(side + "ANKLE_P", -0.437);
  }
  return make_biped(read_urdf(file), names);
}

/// A biped of legs alone whose hips turn about −z, x, y in frames that are themselves turned, knees
/// bend the other way, ankles turn about x, then y. `axis` and `shift` change joint `changed`,
/// the next one stays where it is.
inline Biped odd_biped(const std::string& changed = "",
                       const Eigen::Vector3d& axis = Eigen::Vector3d::Zero(),
                       const Eigen::Vector3d& shift = Eigen::Vector3d::Zero()) {
  using Eigen::Vector3d;
  const Eigen::Matrix3d turned(Eigen::AngleAxisd(std::numbers::pi / 2.0, Vector3d::UnitX()));
  std::vector<Link> links(1);
  links[0].name = "pelvis";
  links[0].inertia = {.mass_kg = 10.0,
                      .com_m = Vector3d::Zero(),
                      .about_com_kg_m2 = 0.1 * Eigen::Matrix3d::Identity()};
  for (const std::string side : {"left_", "right_"}) {
    const double y = side == "left_" ? 1.0 : -1.0;
    const Vector3d axes[] = {-Vector3d::UnitY(), Vector3d::UnitX(), -Vector3d::UnitZ(),
                             Vector3d::UnitY(),  Vector3d::UnitX(), Vector3d::UnitY()};
    const Vector3d places[] = {Vector3d(0.0, 0.1 * y, 0.0),
                               Vector3d::Zero(),
                               Vector3d::Zero(),
                               Vector3d(0.01, 0.02 * y, -0.35),
                               Vector3d(0.02, 0.01 * y, -0.4),
                               Vector3d::Zero()};
    for (int i = 0; i < 6; ++i) {
      Link link;
      link.name = side + "link_" + std::to_string(i);
      link.joint = side + std::to_string(i);
      link.parent = i == 0 ? 0 : static_cast<int>(links.size()) - 1;
      link.type = JointType::revolute;
      link.axis = axes[i];
      link.X_PJ.translation() = places[i];
      // frames of joints 0 .. 2 are turned by 90° about x of the pelvis: their z is its −y, y its z
      if (i == 0) link.X_PJ.linear() = turned;
      if (i == 3) {
        link.X_PJ.linear() = turned.transpose();
        link.X_PJ.translation() = turned.transpose() * places[i];
      }
      link.lower = i == 3 ? -2.2 : -0.7;
      link.upper = i == 3 ? 0.1 : i == 1 ? 2.5 : 0.7;  // the hip's second beyond a right angle
      link.max_speed = 10.0;
      if (i > 0 && links.back().joint == changed) link.X_PJ.translation() -= shift;
      if (link.joint == changed) {
        link.axis = axis;
        link.X_PJ.translation() += shift;
      }
      links.push_back(link);
    }
    Link sole;
    sole.name = side + "sole";
    sole.joint = sole.name + "_frame";
    sole.parent = static_cast<int>(links.size()) - 1;
    sole.X_PJ.translation() = Vector3d(-0.01, 0.0, -0.08);
    links.push_back(sole);
  }
  return make_biped({"odd", links}, {.sole = {"left_sole", "right_sole"},
                                     .hand = {},
                                     .trunk = "pelvis",
                                     .imu = "pelvis",
                                     .sole_back_m = -0.1,
                                     .sole_front_m = 0.1,
                                     .sole_inner_m = 0.05,
                                     .sole_outer_m = 0.05,
                                     .half_sitting = {}});
}

/// A motion of arbitrary posture, velocity and acceleration.
inline RobotMotion random_motion(const RobotTree& tree, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto vector = [&](Eigen::Index n, double size) {
    return Eigen::VectorXd(Eigen::VectorXd::NullaryExpr(n, [&] { return size * unit(random); }));
  };
  RobotMotion m(tree.dof());
  m.q = vector(tree.dof(), 1.5);
  m.dq = vector(tree.dof(), 3.0);
  m.ddq = vector(tree.dof(), 20.0);
  m.X_WB.linear() = math::exp_so3(vector(3, 2.0));
  m.X_WB.translation() = vector(3, 2.0);
  m.v_W = vector(3, 2.0);
  m.omega_W = vector(3, 2.0);
  m.a_W = vector(3, 5.0);
  m.alpha_W = vector(3, 10.0);
  return m;
}

}  // namespace mimesis::robot
