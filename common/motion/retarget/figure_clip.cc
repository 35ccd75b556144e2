#include "common/motion/retarget/figure_clip.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "common/math/so3.h"
#include "common/motion/retarget/leg_ik.h"

namespace mimesis::retarget {
namespace {

using Eigen::Index, Eigen::Vector3d;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// Bends the legs of a pose so that ankles of `body` are where the pose says.
void bend_legs(const mocap::Body& body, mocap::BodyPose& pose) {
  for (const int hip : {int{mocap::kLeftHip}, int{mocap::kRightHip}}) {
    const Vector3d hip_W = pose.point(mocap::kRoot, body.offset_m[at(hip)]);
    const LimbPosture leg =
        reach({body.offset_m[at(hip + 1)], body.offset_m[at(hip + 2)]}, pose.R_WJ[at(hip)],
              pose.R_WJ[at(hip + 1)], hip_W, pose.p_WJ[at(hip + 2)]);
    pose.R_WJ[at(hip)] = leg.R_upper;
    pose.R_WJ[at(hip + 1)] = leg.R_lower;
  }
}

/// Writes the rotations relative to the parents into a column, each next to the one before.
void put_angles(const mocap::BodyPose& pose, Index t, Eigen::MatrixXd& angles_rad) {
  for (int j = 0; j < mocap::kBodyJoints; ++j) {
    const int parent = mocap::kBodyParents[at(j)];
    const Eigen::Matrix3d R =
        parent < 0 ? pose.R_WJ[at(j)] : pose.R_WJ[at(parent)].transpose() * pose.R_WJ[at(j)];
    const Vector3d before = t == 0 ? Vector3d::Zero() : angles_rad.block<3, 1>(3 * j, t - 1).eval();
    angles_rad.block<3, 1>(3 * j, t) = math::nearest_axis_angle(math::log_so3(R), before);
  }
}

struct Sum {
  double squares = 0.0, max = 0.0;
  void add(double value) {
    squares += value * value;
    max = std::max(max, value);
  }
  Deviation over(Index count) const {
    return {std::sqrt(squares / static_cast<double>(std::max<Index>(count, 1))), max};
  }
};

}  // namespace

FigureClip figure_clip(const RobotClip& motion, const mocap::BodyClip& recorded,
                       const robot::RobotTree& tree, const RobotFigure& figure) {
  FigureClip out;
  mocap::BodyClip& clip = out.clip;
  clip.body = robot_body(tree, figure);
  clip.name = recorded.name;
  clip.rate_hz = motion.rate_hz;
  clip.first_frame = recorded.first_frame;
  clip.root_position_W_m = motion.pelvis_position_W_m;
  clip.angles_rad.resize(mocap::kBodyRows, motion.frames());
  robot::Kinematics kinematics(tree);
  Sum ankles, wrists;
  for (Index t = 0; t < motion.frames(); ++t) {
    const Posture posture = motion.posture(t);
    kinematics.update(posture.X_WB, posture.q);
    const mocap::BodyPose robot = body_pose(kinematics, figure);
    mocap::BodyPose pose = robot;
    bend_legs(clip.body, pose);
    put_angles(pose, t, clip.angles_rad);
    const mocap::BodyPose made = clip.pose(t);
    const auto apart = [&](int joint) {
      return (made.p_WJ[at(joint)] - robot.p_WJ[at(joint)]).norm();
    };
    for (const int joint : {int{mocap::kLeftAnkle}, int{mocap::kRightAnkle}})
      ankles.add(apart(joint));
    for (const int joint : {int{mocap::kLeftWrist}, int{mocap::kRightWrist}})
      wrists.add(apart(joint));
  }
  out.ankle_m = ankles.over(2 * motion.frames());
  out.wrist_m = wrists.over(2 * motion.frames());
  return out;
}

}  // namespace mimesis::retarget
