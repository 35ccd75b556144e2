#include "common/robot/biped.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/error.h"
#include "common/robot/kinematics.h"

namespace mimesis::robot {
namespace {

using Eigen::Isometry3d, Eigen::Vector3d, Eigen::VectorXd;

/// Joints from the root to the sole, checked.
Biped::Leg make_leg(const RobotTree& tree, const std::string& sole) {
  Biped::Leg leg;
  leg.sole = tree.require_link(sole);
  const std::string where = tree.name() + ": leg of '" + sole + "': ";
  std::vector<int> dofs;
  for (int l = leg.sole; l > 0; l = tree.link(l).parent) {
    const Link& link = tree.link(l);
    if (link.dof < 0) continue;
    if (link.type != JointType::revolute) {
      throw ConfigError(where + "joint '" + link.joint + "' slides, expected one that turns");
    }
    if (dofs.empty()) leg.foot = l;
    dofs.push_back(link.dof);
  }
  if (dofs.size() != leg.dof.size()) {
    throw ConfigError(where + std::to_string(dofs.size()) + " joints, expected 6");
  }
  std::ranges::reverse_copy(dofs, leg.dof.begin());
  return leg;
}

/// Where the axes of a leg's joints `first` .. `last` meet, or are nearest, in the zero posture; of
/// parallel ones, the origin of the last.
Vector3d centre_of(const Kinematics& zero, const Biped::Leg& leg, LegJoint first, LegJoint last) {
  const RobotTree& tree = zero.tree();
  std::vector<Line> lines;
  for (std::size_t i = first; i <= last; ++i) {
    const Isometry3d& X = zero.X_WL(tree.moved_link(leg.dof[i]));
    lines.push_back(
        {.point = X.translation(), .direction = X.linear() * tree.moved(leg.dof[i]).axis});
  }
  constexpr double kAnyDistance = std::numeric_limits<double>::infinity();
  return meeting_point(lines, kAnyDistance).value_or(lines.back().point);
}

/// Centres of hip and ankle.
void find_centres(const Kinematics& zero, Biped::Leg& leg) {
  const auto in_link = [&](const Vector3d& p, LegJoint joint) -> Vector3d {
    const Vector3d own = zero.X_WL(zero.tree().moved_link(leg.dof[joint])).inverse() * p;
    return own.norm() < 1e-6 ? Vector3d::Zero() : own;
  };
  const Vector3d ankle = centre_of(zero, leg, kAnkleFirst, kAnkleLast);
  leg.ankle_S_m = zero.X_WL(leg.sole).inverse() * ankle;
  leg.ankle_A_m = in_link(ankle, kAnkleFirst);
  leg.hip_T_m = in_link(centre_of(zero, leg, kHipFirst, kHipLast), kHipLast);
}

void check_sole(const RobotTree& tree, const BipedNames& names) {
  if (names.sole_back_m < 0.0 && names.sole_front_m > 0.0 && names.sole_inner_m > 0.0 &&
      names.sole_outer_m > 0.0) {
    return;
  }
  throw ConfigError(tree.name() + ": sole, expected back < 0 < front and inner and outer above 0");
}

VectorXd half_sitting_of(const RobotTree& tree, const BipedNames& names) {
  VectorXd q = VectorXd::Zero(tree.dof());
  for (const auto& [joint, angle] : names.half_sitting) q[tree.require_joint(joint)] = angle;
  for (int i = 0; i < tree.dof(); ++i) {
    const Link& link = tree.moved(i);
    if (q[i] >= link.lower && q[i] <= link.upper) continue;
    throw ConfigError(tree.name() + ": half-sitting: joint '" + link.joint + "' at " +
                      std::to_string(q[i]) + ", expected within its limits " +
                      std::to_string(link.lower) + " .. " + std::to_string(link.upper));
  }
  return q;
}

/// Puts the half-sitting robot on the ground.
void stand(Biped& biped) {
  constexpr double kLevel = 1e-6;
  Kinematics kinematics(biped.tree);
  kinematics.update(Isometry3d::Identity(), biped.half_sitting);
  std::array<Isometry3d, 2> X_BS;
  for (const Side side : kSides) {
    X_BS[side] = kinematics.X_WL(biped.leg[side].sole);
    if ((X_BS[side].linear() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > kLevel) {
      throw ConfigError(biped.tree.name() + ": half-sitting: sole '" +
                        biped.tree.link(biped.leg[side].sole).name +
                        "' is turned, expected parallel to the pelvis");
    }
  }
  const Vector3d across = X_BS[kLeft].translation() - X_BS[kRight].translation();
  if (std::abs(across.z()) > kLevel || std::abs(across.x()) > kLevel || !(across.y() > 0.0)) {
    throw ConfigError(biped.tree.name() +
                      ": half-sitting: expected the soles on one plane, the left one beside and "
                      "left of the right");
  }
  const Vector3d middle = 0.5 * (X_BS[kLeft].translation() + X_BS[kRight].translation());
  biped.X_WB_half_sitting = Isometry3d(Eigen::Translation3d(-middle));
  biped.feet_distance_m = across.y();
  if (!(biped.tree.mass_kg() > 0.0)) {
    throw ConfigError(biped.tree.name() + ": no mass, expected a robot with one");
  }
  biped.com_height_m = kinematics.com().z() - middle.z();
}

}  // namespace

Biped make_biped(RobotTree tree, const BipedNames& names) {
  check_sole(tree, names);
  const Kinematics zero(tree);
  std::array<Biped::Leg, 2> legs;
  for (const Side side : kSides) {
    Biped::Leg& leg = legs[side];
    leg = make_leg(tree, names.sole[side]);
    find_centres(zero, leg);
    const double left = side == kLeft ? names.sole_outer_m : names.sole_inner_m;
    const double right = side == kLeft ? names.sole_inner_m : names.sole_outer_m;
    leg.min_S_m = {names.sole_back_m, -right};
    leg.max_S_m = {names.sole_front_m, left};
  }
  std::vector<int> upper_body;
  for (int i = 0; i < tree.dof(); ++i) {
    const auto in = [i](const Biped::Leg& leg) { return std::ranges::count(leg.dof, i); };
    if (in(legs[kLeft]) + in(legs[kRight]) == 2) {
      throw ConfigError(tree.name() + ": joint '" + tree.moved(i).joint +
                        "' carries both soles, expected two legs");
    }
    if (in(legs[kLeft]) + in(legs[kRight]) == 0) upper_body.push_back(i);
  }
  VectorXd half_sitting = half_sitting_of(tree, names);
  Biped biped{.tree = std::move(tree),
              .leg = legs,
              .upper_body = std::move(upper_body),
              .half_sitting = std::move(half_sitting),
              .X_WB_half_sitting = Isometry3d::Identity()};
  for (const Side side : kSides) {
    if (!names.hand[side].empty()) biped.hand[side] = biped.tree.require_link(names.hand[side]);
    if (names.gripper[side].empty()) continue;
    biped.gripper[side] = {biped.tree.require_joint(names.gripper[side]),
                           names.gripper_closed_rad[side]};
  }
  biped.trunk = biped.tree.require_link(names.trunk);
  if (!names.head.empty()) biped.head = biped.tree.require_link(names.head);
  biped.imu = biped.tree.require_link(names.imu);
  biped.step_s = names.step_s;
  biped.gait = names.gait;
  stand(biped);
  return biped;
}

double leg_length_m(const Biped& biped) {
  const Biped::Leg& leg = biped.leg[kLeft];
  const RobotTree& tree = biped.tree;
  // from the frame of the link that the joint before moves, whatever is fixed between them
  const auto frame = [&](LegJoint joint) {
    int l = tree.moved_link(leg.dof[joint]);
    Isometry3d X = tree.link(l).X_PJ;
    while (tree.link(l = tree.link(l).parent).dof < 0) X = tree.link(l).X_PJ * X;
    return X;
  };
  return (frame(kKnee).translation() - leg.hip_T_m).norm() +
         (frame(kAnkleFirst) * leg.ankle_A_m).norm();
}

std::vector<int> moved_links(const RobotTree& tree, int above, int link) {
  std::vector<int> links;
  for (int l = link; l >= 0 && l != above; l = tree.link(l).parent) {
    if (tree.link(l).dof >= 0) links.push_back(l);
  }
  std::ranges::reverse(links);
  return links;
}

Arm arm_of(const Biped& biped, Side side) {
  const std::string which = side == kLeft ? "left" : "right";
  if (biped.hand[side] < 0) {
    throw ConfigError(biped.tree.name() + ": no " + which + " hand, expected two hands");
  }
  const std::vector<int> links = moved_links(biped.tree, biped.trunk, biped.hand[side]);
  if (links.size() < 5) {
    throw ConfigError(biped.tree.name() + ": hand '" + biped.tree.link(biped.hand[side]).name +
                      "': " + std::to_string(links.size()) +
                      " joints between trunk and hand, expected 5 or more: three of a shoulder, an "
                      "elbow, a wrist");
  }
  return {.shoulder = links[2], .elbow = links[3], .wrist = links.back()};
}

}  // namespace mimesis::robot
