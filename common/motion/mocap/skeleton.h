#pragma once
#include <Eigen/Core>
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

  Eigen::Index frames() const { return rotation_rad.cols(); }
};

/// The text with '?' in place of control characters: names from files as they may stand in a
/// message of one line.
std::string one_line(std::string text);

}  // namespace mimesis::mocap
