#pragma once
#include <Eigen/Core>
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace mimesis::mocap {

/// One joint of a recorded skeleton.
struct Joint {
  std::string name;  ///< name in the file
  int parent = -1;   ///< index, below this joint's own; -1 for the root
  /// Joint centre in the parent's frame in the zero posture [m].
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();
};

/// A tree of ball joints. Frames of all joints are parallel in the zero posture: x forward, y left,
/// z up, for all files (readers convert).
struct Skeleton {
  std::vector<Joint> joints;  ///< parents first; 0 is the root
  /// Ends of the chains (BVH "End Site", ASF bone tips): `parent` is the joint that carries them.
  std::vector<Joint> ends;
  int find(std::string_view name) const;  ///< index, or -1
};

/// A recorded motion. `W`: world, z up.
struct Clip {
  std::string name;  ///< file name without folder
  Skeleton skeleton;
  double rate_hz = 0.0;
  Eigen::Matrix3Xd root_position_W_m;  ///< position of the root joint, 3×frames
  /// Rotation of every joint relative to its parent (of the root: to W) as axis-angle θw [rad],
  /// without jumps by 2π: rows 3j..3j+2 of joint j, one column a frame.
  Eigen::MatrixXd rotation_rad;
  /// What the reader took that the file does not say, or mended: a line each, for the user.
  std::vector<std::string> notes{};

  Eigen::Index frames() const { return rotation_rad.cols(); }
};

/// Where every joint of a clip's skeleton is. W: world, z up.
struct SkeletonPose {
  std::vector<Eigen::Matrix3d> R_WJ;
  std::vector<Eigen::Vector3d> p_WJ;  ///< joint centres [m]
};
/// The pose in a frame; in frame -1 the zero posture, with the root at the origin.
SkeletonPose skeleton_pose(const Clip& clip, Eigen::Index frame);

/// The text with '?' in place of control characters: names from files as they may stand in a
/// message of one line.
std::string one_line(std::string text);

/// The human figure that motion is learned for: 17 ball joints [M18 3.3.1].
inline constexpr int kBodyJoints = 17;
inline constexpr int kBodyRows = 3 * kBodyJoints;  ///< axis-angle components, joint-major: x, y, z
inline constexpr std::array<std::string_view, kBodyJoints> kBodyJointNames = {
    "root", "lhip", "lknee", "lank", "rhip", "rknee", "rank", "spine", "chest",
    "neck", "head", "lsho",  "lelb", "lwri", "rsho",  "relb", "rwri"};
inline constexpr std::array<int, kBodyJoints> kBodyParents = {-1, 0, 1, 2,  0,  4, 5,  0, 7,
                                                              8,  9, 8, 11, 12, 8, 14, 15};
enum BodyJoint {
  kRoot,
  kLeftHip,
  kLeftKnee,
  kLeftAnkle,
  kRightHip,
  kRightKnee,
  kRightAnkle,
  kSpine,
  kChest,
  kNeck,
  kHead,
  kLeftShoulder,
  kLeftElbow,
  kLeftWrist,
  kRightShoulder,
  kRightElbow,
  kRightWrist
};
enum Side { kLeft, kRight };

/// Names of the rows: "lhip.x". Axes x forward, y left, z up in the zero posture.
std::string body_row_name(int row);

/// Points at the origin: `{}` would leave Eigen's vectors as the memory was.
template <std::size_t kCount>
std::array<Eigen::Vector3d, kCount> points_at_origin() {
  std::array<Eigen::Vector3d, kCount> points;
  points.fill(Eigen::Vector3d::Zero());
  return points;
}

/// Segment lengths of one person or character. Positions in the frame of the joint that carries
/// them, zero posture [m].
struct Body {
  std::string name;
  /// Joint centre in the parent's frame; the root's is 0.
  std::array<Eigen::Vector3d, kBodyJoints> offset_m = points_at_origin<kBodyJoints>();
  /// Ground points, in the ankles' frames.
  std::array<Eigen::Vector3d, 2> toe_m = points_at_origin<2>(), heel_m = points_at_origin<2>();
  /// Finger tips, in the wrists' frames.
  std::array<Eigen::Vector3d, 2> hand_m = points_at_origin<2>();
  Eigen::Vector3d head_top_m = Eigen::Vector3d::Zero();
};

/// Where everything is. W: world, z up.
struct BodyPose {
  std::array<Eigen::Matrix3d, kBodyJoints> R_WJ;
  std::array<Eigen::Vector3d, kBodyJoints> p_WJ;  ///< joint centres [m]
  Eigen::Vector3d point(int joint, const Eigen::Vector3d& p_J) const {
    return p_WJ[static_cast<std::size_t>(joint)] + R_WJ[static_cast<std::size_t>(joint)] * p_J;
  }
};

/// Forward kinematics. `angles_rad`: axis-angle of all joints relative to the parent, the root's
/// relative to W. Does not allocate.
BodyPose forward_kinematics(const Body& body, std::span<const double, kBodyRows> angles_rad,
                            const Eigen::Vector3d& p_W_root);
/// Its inverse: writes the axis-angle vectors of a pose into a column (51 rows), each the one
/// nearest to that of the column before.
void put_angles(const BodyPose& pose, Eigen::Index column, Eigen::MatrixXd& angles_rad);

/// A recorded motion of the 17-joint figure. `W`: world, z up.
struct BodyClip {
  Body body;
  std::string name;  ///< file name without folder
  double rate_hz = 0.0;
  long first_frame = 0;                ///< number of column 0 in the file, from 0
  Eigen::Matrix3Xd root_position_W_m;  ///< position of the root joint, 3×frames
  Eigen::MatrixXd angles_rad;          ///< 51×frames, axis-angle as in forward_kinematics()

  Eigen::Index frames() const { return angles_rad.cols(); }
  /// Where everything is in a frame.
  BodyPose pose(Eigen::Index frame) const;
};

/// An adult of 1.70 m with de Leva's segment lengths: for characters without a recording.
Body standard_body();

}  // namespace mimesis::mocap
