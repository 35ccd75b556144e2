#include "common/motion/retarget/robot_figure.h"

#include <numbers>

#include "common/error.h"
#include "common/math/so3.h"

namespace mimesis::retarget {
namespace {

using Eigen::Isometry3d, Eigen::Matrix3d, Eigen::Vector3d;

// Feet before hands where the limits do not permit both
constexpr double kFootWeight = 10.0;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// From the robot's hanging arms to the person's arms sideways: −z becomes ±y.
Matrix3d sideways(std::size_t side) {
  return math::exp_so3({(side == 0 ? 0.5 : -0.5) * std::numbers::pi, 0.0, 0.0});
}

/// Origin of `link` in the frame of `above`, zero posture.
Vector3d origin_in(const robot::RobotTree& tree, int above, int link) {
  Isometry3d X = Isometry3d::Identity();
  for (int l = link; l != above; l = tree.link(l).parent) X = tree.link(l).X_PJ * X;
  return X.translation();
}

void require_parallel(const robot::RobotTree& tree, const RobotFigure& f) {
  constexpr double kParallel = 1e-6;
  const robot::Kinematics zero(tree);
  std::vector<std::string> names = {f.spine, f.chest, f.neck, f.head};
  for (const auto* pair : {&f.hip, &f.knee, &f.ankle, &f.shoulder, &f.elbow, &f.wrist}) {
    names.insert(names.end(), pair->begin(), pair->end());
  }
  for (const std::string& name : names) {
    const Matrix3d& R = zero.X_WL(tree.require_link(name)).linear();
    if ((R - Matrix3d::Identity()).cwiseAbs().maxCoeff() < kParallel) continue;
    throw ConfigError(tree.name() + ": link '" + name + "' is turned in the zero posture, " +
                      "expected frames parallel to the pelvis: x forward, y left, z up");
  }
}

}  // namespace

RobotFigure figure_of(const robot::Biped& biped) {
  const robot::RobotTree& tree = biped.tree;
  const auto name = [&](int link) { return tree.link(link).name; };
  const std::vector<int> spine = robot::moved_links(tree, 0, biped.trunk);
  if (spine.empty())
    throw ConfigError(tree.name() + ": trunk: expected a link above a waist joint");
  if (biped.head < 0) throw ConfigError(tree.name() + ": head: none, expected a link");
  const std::vector<int> neck = robot::moved_links(tree, biped.trunk, biped.head);
  if (neck.empty() || !tree.carries(biped.trunk, biped.head)) {
    throw ConfigError(tree.name() + ": head: '" + name(biped.head) +
                      "', expected a link that joints move on the trunk");
  }
  RobotFigure f;
  f.pelvis = name(tree.link(spine.front()).parent);
  f.spine = name(spine.front());
  f.chest = name(biped.trunk);
  f.neck = name(neck.front());
  f.head = name(biped.head);
  std::vector<int> moved = neck;  // by joints that have an angle in the easy posture
  for (const robot::Side side : robot::kSides) {
    const robot::Biped::Leg& leg = biped.leg[side];
    const robot::Arm arm = robot::arm_of(biped, side);
    f.hip[side] = tree.moved(leg.dof[robot::kHipLast]).name;
    f.knee[side] = tree.moved(leg.dof[robot::kKnee]).name;
    f.ankle[side] = name(leg.foot);
    f.shoulder[side] = name(arm.shoulder);
    f.elbow[side] = name(arm.elbow);
    f.wrist[side] = name(arm.wrist);
    const Vector3d sole = origin_in(tree, leg.foot, leg.sole);
    f.heel_m[side] = sole + Vector3d(leg.min_S_m.x(), 0.0, 0.0);
    f.toe_m[side] = sole + Vector3d(leg.max_S_m.x(), 0.0, 0.0);
    f.hand_m[side] = origin_in(tree, arm.wrist, biped.hand[side]);
    for (const int tip : {leg.sole, biped.hand[side]}) {
      const std::vector<int> limb = robot::moved_links(tree, 0, tip);
      moved.insert(moved.end(), limb.begin(), limb.end());
    }
  }
  for (const int link : moved) {
    const robot::Link& l = tree.link(link);
    if (biped.half_sitting[l.dof] != 0.0) f.start_rad[l.joint] = biped.half_sitting[l.dof];
  }
  require_parallel(tree, f);
  return f;
}

mocap::Body robot_body(const robot::RobotTree& tree, const RobotFigure& f) {
  const robot::Kinematics zero(tree);
  const auto place = [&](const std::string& link) {
    return Vector3d(zero.X_WL(tree.require_link(link)).translation());
  };
  mocap::Body body;
  body.name = tree.name();
  const auto set = [&](int joint, const std::string& link, const std::string& parent) {
    body.offset_m[at(joint)] = place(link) - place(parent);
  };
  set(mocap::kSpine, f.spine, f.pelvis);
  set(mocap::kChest, f.chest, f.spine);
  set(mocap::kNeck, f.neck, f.chest);
  set(mocap::kHead, f.head, f.neck);
  body.head_top_m = {0.0, 0.0, f.head_height_m};
  for (const std::size_t side : {0u, 1u}) {
    const int hip = side == 0 ? mocap::kLeftHip : mocap::kRightHip;
    const int shoulder = side == 0 ? mocap::kLeftShoulder : mocap::kRightShoulder;
    set(hip, f.hip[side], f.pelvis);
    set(hip + 1, f.knee[side], f.hip[side]);
    set(hip + 2, f.ankle[side], f.knee[side]);
    set(shoulder, f.shoulder[side], f.chest);
    const Matrix3d R = sideways(side);
    body.offset_m[at(shoulder + 1)] = R * (place(f.elbow[side]) - place(f.shoulder[side]));
    body.offset_m[at(shoulder + 2)] = R * (place(f.wrist[side]) - place(f.elbow[side]));
    body.hand_m[side] = R * f.hand_m[side];
    body.heel_m[side] = f.heel_m[side];
    body.toe_m[side] = f.toe_m[side];
  }
  return body;
}

mocap::BodyPose body_pose(const robot::Kinematics& kinematics, const RobotFigure& f) {
  mocap::BodyPose pose;
  const auto set = [&](int joint, const std::string& link, const Matrix3d& R_LJ) {
    const Isometry3d& X_WL = kinematics.X_WL(kinematics.tree().require_link(link));
    pose.R_WJ[at(joint)] = X_WL.linear() * R_LJ;
    pose.p_WJ[at(joint)] = X_WL.translation();
  };
  const Matrix3d I = Matrix3d::Identity();
  set(mocap::kRoot, f.pelvis, I);
  set(mocap::kSpine, f.spine, I);
  set(mocap::kChest, f.chest, I);
  set(mocap::kNeck, f.neck, I);
  set(mocap::kHead, f.head, I);
  for (const std::size_t side : {0u, 1u}) {
    const int hip = side == 0 ? mocap::kLeftHip : mocap::kRightHip;
    const int shoulder = side == 0 ? mocap::kLeftShoulder : mocap::kRightShoulder;
    const Matrix3d hanging = sideways(side).transpose();
    set(hip, f.hip[side], I);
    set(hip + 1, f.knee[side], I);
    set(hip + 2, f.ankle[side], I);
    set(shoulder, f.shoulder[side], hanging);
    set(shoulder + 1, f.elbow[side], hanging);
    set(shoulder + 2, f.wrist[side], hanging);
  }
  return pose;
}

RobotGoals::RobotGoals(const robot::RobotTree& tree, const RobotFigure& figure)
    : start_(Eigen::VectorXd::Zero(tree.dof())),
      pelvis_(tree.require_link(figure.pelvis)),
      chest_(tree.require_link(figure.chest)),
      head_(tree.require_link(figure.head)) {
  for (const auto& [joint, angle] : figure.start_rad) start_[tree.require_joint(joint)] = angle;
  start_ = start_.cwiseMax(tree.lower()).cwiseMin(tree.upper());
  for (const std::size_t side : {0u, 1u}) {
    ankle_[side] = tree.require_link(figure.ankle[side]);
    wrist_[side] = tree.require_link(figure.wrist[side]);
    elbow_[side] = tree.require_link(figure.elbow[side]);
    knee_[side] = tree.require_link(figure.knee[side]);
    sole_m_[side] = 0.5 * (figure.heel_m[side] + figure.toe_m[side]);
    hand_m_[side] = figure.hand_m[side];
  }
}

std::vector<Goal> RobotGoals::exact(const mocap::BodyPose& pose) const {
  std::vector<Goal> goals;
  for (const std::size_t side : {0u, 1u}) {
    const int ankle = side == 0 ? mocap::kLeftAnkle : mocap::kRightAnkle;
    goals.push_back(goal(ankle_[side], pose.R_WJ[at(ankle)], pose.point(ankle, sole_m_[side]),
                         kFootWeight, kFootWeight, sole_m_[side]));
  }
  for (const std::size_t side : {0u, 1u}) {
    const int wrist = side == 0 ? mocap::kLeftWrist : mocap::kRightWrist;
    const Matrix3d R_WE = pose.R_WJ[at(wrist)] * sideways(side);
    goals.push_back(goal(wrist_[side], R_WE, pose.p_WJ[at(wrist)] + R_WE * hand_m_[side], 1.0, 0.0,
                         hand_m_[side]));
  }
  return goals;
}

std::vector<Goal> RobotGoals::wishes(const mocap::BodyPose& pose) const {
  const auto joint = [&](int link, int j, const Matrix3d& R, double position, double orientation) {
    return goal(link, pose.R_WJ[at(j)] * R, pose.p_WJ[at(j)], position, orientation);
  };
  const Matrix3d I = Matrix3d::Identity();
  std::vector<Goal> goals = {joint(pelvis_, mocap::kRoot, I, 3.0, 0.6),
                             joint(chest_, mocap::kChest, I, 0.0, 1.0),
                             joint(head_, mocap::kHead, I, 0.0, 0.6)};
  for (const std::size_t side : {0u, 1u}) {
    const int knee = side == 0 ? mocap::kLeftKnee : mocap::kRightKnee;
    const int wrist = side == 0 ? mocap::kLeftWrist : mocap::kRightWrist;
    goals.push_back(joint(knee_[side], knee, I, 1.0, 0.0));
    goals.push_back(joint(elbow_[side], wrist - 1, I, 1.0, 0.0));
    goals.push_back(joint(wrist_[side], wrist, sideways(side), 0.0, 0.15));
  }
  return goals;
}

Posture RobotGoals::start(const mocap::BodyPose& pose) const {
  Posture posture;
  posture.X_WB.linear() = pose.R_WJ[mocap::kRoot];
  posture.X_WB.translation() = pose.p_WJ[mocap::kRoot];
  posture.q = start_;
  return posture;
}

}  // namespace mimesis::retarget
