#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace mimesis::mocap {

/// Optical markers over time, as a C3D file holds them. A missing marker is NaN.
struct Markers {
  std::string name;  ///< file name without folder
  std::vector<std::string> labels;
  double rate_hz = 0.0;
  long first_frame = 1;  ///< number of column 0 in the recording
  /// Rows 3m..3m+2 of marker m in the file's axes [m], one column a frame.
  Eigen::MatrixXd position_m;
  Eigen::Index frames() const { return position_m.cols(); }
};

/// Pose of a rigid body: p_W = R_WB p_B + p_WB.
struct RigidFit {
  Eigen::Matrix3d R_WB;
  Eigen::Vector3d p_WB;
};

/// The rotation and translation that bring `body` nearest to `world` in the least-squares sense
/// (orthogonal Procrustes problem by SVD, reflections excluded; Kabsch 1976, [M18 3.3.2]).
/// @param body, world  3×N, the same points; columns in which either is NaN do not count
/// @returns nothing with fewer than three points, or if they lie on a line to 1 mm
std::optional<RigidFit> fit_rigid(const Eigen::Ref<const Eigen::Matrix3Xd>& body,
                                  const Eigen::Ref<const Eigen::Matrix3Xd>& world);

/// Markers that sit on one rigid segment: indices in Markers::labels, may sit in several groups.
using MarkerGroup = std::vector<Eigen::Index>;

/// Fills missing (NaN) marker positions in place. A marker of a group of which three others are
/// seen is put at its place in the group's nominal geometry [M18 3.3.2]; the deviation of its own
/// positions from there at the ends of the gap fades linearly through it, so that nothing jumps.
/// Remaining gaps of at most `longest_s` are bridged by a natural cubic spline through the marker's
/// own positions. Longer gaps, and those at the ends of the recording, stay NaN; groups without a
/// geometry (fewer than three markers, on one line, or never seen together) are left to
/// the splines.
void fill_gaps(Markers& markers, std::span<const MarkerGroup> groups, double longest_s = 0.3);

}  // namespace mimesis::mocap
