#pragma once
#include <Eigen/Core>
#include <optional>

namespace mimesis::mocap {

/// Pose of a rigid body: p_W = R_WB p_B + p_WB.
struct RigidFit {
  Eigen::Matrix3d R_WB;
  Eigen::Vector3d p_WB;
  double rms_m = 0.0;  ///< of the points' distances after the fit
};

/// The rotation and translation that bring `body` nearest to `world` in the least-squares sense
/// (orthogonal Procrustes problem by SVD, reflections excluded; Kabsch 1976, [M18 3.3.2]).
/// @param body, world  3×N, the same points; columns in which either is NaN do not count
/// @returns nothing with fewer than three points, or if they lie on a line to 1 mm
std::optional<RigidFit> fit_rigid(const Eigen::Ref<const Eigen::Matrix3Xd>& body,
                                  const Eigen::Ref<const Eigen::Matrix3Xd>& world);

}  // namespace mimesis::mocap
