#include "common/motion/mocap/body.h"

#include <algorithm>

#include "common/math/so3.h"

namespace mimesis::mocap {

int Skeleton::find(std::string_view name) const {
  const auto found = std::find_if(joints.begin(), joints.end(),
                                  [name](const Joint& joint) { return joint.name == name; });
  return found == joints.end() ? -1 : static_cast<int>(found - joints.begin());
}

SkeletonPose skeleton_pose(const Clip& clip, Eigen::Index frame) {
  const std::vector<Joint>& joints = clip.skeleton.joints;
  SkeletonPose pose{std::vector<Eigen::Matrix3d>(joints.size(), Eigen::Matrix3d::Identity()),
                    std::vector<Eigen::Vector3d>(joints.size(), Eigen::Vector3d::Zero())};
  for (std::size_t j = 0; j < joints.size(); ++j) {
    Eigen::Matrix3d R_PJ = Eigen::Matrix3d::Identity();
    if (frame >= 0) {
      R_PJ = math::exp_so3(clip.rotation_rad.block<3, 1>(3 * static_cast<Eigen::Index>(j), frame));
    }
    if (joints[j].parent < 0) {
      pose.R_WJ[j] = R_PJ;
      if (frame >= 0) pose.p_WJ[j] = clip.root_position_W_m.col(frame);
    } else {
      const auto parent = static_cast<std::size_t>(joints[j].parent);
      pose.R_WJ[j] = pose.R_WJ[parent] * R_PJ;
      pose.p_WJ[j] = pose.p_WJ[parent] + pose.R_WJ[parent] * joints[j].offset_m;
    }
  }
  return pose;
}

std::string one_line(std::string text) {
  for (char& c : text) {
    if ((c >= 0 && c < ' ') || c == '\x7f') c = '?';
  }
  return text;
}

std::string body_row_name(int row) {
  return std::string(kBodyJointNames[static_cast<std::size_t>(row / 3)]) + '.' + "xyz"[row % 3];
}

BodyPose forward_kinematics(const Body& body, std::span<const double, kBodyRows> angles_rad,
                            const Eigen::Vector3d& p_W_root) {
  BodyPose pose;
  for (std::size_t j = 0; j < kBodyJoints; ++j) {
    const Eigen::Matrix3d R_PJ =
        math::exp_so3({angles_rad[3 * j], angles_rad[3 * j + 1], angles_rad[3 * j + 2]});
    if (kBodyParents[j] < 0) {
      pose.R_WJ[j] = R_PJ;
      pose.p_WJ[j] = p_W_root;
      continue;
    }
    const auto parent = static_cast<std::size_t>(kBodyParents[j]);
    pose.R_WJ[j] = pose.R_WJ[parent] * R_PJ;
    pose.p_WJ[j] = pose.p_WJ[parent] + pose.R_WJ[parent] * body.offset_m[j];
  }
  return pose;
}

void put_angles(const BodyPose& pose, Eigen::Index column, Eigen::MatrixXd& angles_rad) {
  for (std::size_t j = 0; j < kBodyJoints; ++j) {
    Eigen::Matrix3d R_PJ = pose.R_WJ[j];
    if (kBodyParents[j] >= 0) {
      R_PJ = pose.R_WJ[static_cast<std::size_t>(kBodyParents[j])].transpose() * R_PJ;
    }
    const auto row = static_cast<Eigen::Index>(3 * j);
    const Eigen::Vector3d before = column > 0
                                       ? Eigen::Vector3d(angles_rad.block<3, 1>(row, column - 1))
                                       : Eigen::Vector3d(Eigen::Vector3d::Zero());
    angles_rad.block<3, 1>(row, column) = math::nearest_axis_angle(math::log_so3(R_PJ), before);
  }
}

BodyPose BodyClip::pose(Eigen::Index frame) const {
  return forward_kinematics(body,
                            std::span<const double, kBodyRows>(angles_rad.col(frame).data(),
                                                               static_cast<std::size_t>(kBodyRows)),
                            root_position_W_m.col(frame));
}

// Segment lengths as fractions of the height: de Leva 1996, J. Biomech. 29, table 4 (male), for
// 1.70 m; pelvis and shoulder widths are usual anthropometric means.
Body standard_body() {
  Body b;
  b.name = "standard";
  auto set = [&](BodyJoint joint, double x, double y, double z) {
    b.offset_m[static_cast<std::size_t>(joint)] = {x, y, z};
  };
  for (const Side side : {kLeft, kRight}) {
    const double y = side == kLeft ? 1.0 : -1.0;
    set(side == kLeft ? kLeftHip : kRightHip, 0.0, 0.085 * y, -0.05);
    set(side == kLeft ? kLeftKnee : kRightKnee, 0.0, 0.0, -0.412);
    set(side == kLeft ? kLeftAnkle : kRightAnkle, 0.0, 0.0, -0.423);
    set(side == kLeft ? kLeftShoulder : kRightShoulder, 0.0, 0.175 * y, 0.17);
    set(side == kLeft ? kLeftElbow : kRightElbow, 0.0, 0.275 * y, 0.0);
    set(side == kLeft ? kLeftWrist : kRightWrist, 0.0, 0.263 * y, 0.0);
    b.heel_m[side] = {-0.05, 0.0, -0.08};
    b.toe_m[side] = {0.17, 0.0, -0.08};
    b.hand_m[side] = {0.0, 0.17 * y, 0.0};
  }
  set(kSpine, 0.0, 0.0, 0.09);
  set(kChest, 0.0, 0.0, 0.16);
  set(kNeck, 0.0, 0.0, 0.23);
  set(kHead, 0.0, 0.0, 0.08);
  b.head_top_m = {0.0, 0.0, 0.19};
  return b;
}

}  // namespace mimesis::mocap
