#include "common/motion/mocap/joint_centres.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace mimesis::mocap {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;

Matrix3Xd points(const Markers& markers, const MarkerGroup& group, Index frame) {
  Matrix3Xd p(3, static_cast<Index>(group.markers.size()));
  for (std::size_t i = 0; i < group.markers.size(); ++i) {
    p.col(static_cast<Index>(i)) = markers.position_m.block<3, 1>(3 * group.markers[i], frame);
  }
  return p;
}

}  // namespace

tl::expected<Matrix3Xd, Status> nominal_geometry(const Markers& markers, const MarkerGroup& group) {
  auto refuse = [&](const std::string& reason) {
    return tl::unexpected(Status{markers.name + ": marker group " + group.name + ": " + reason});
  };
  if (group.markers.size() < 3) {
    return refuse(std::to_string(group.markers.size()) + " markers, expected at least 3");
  }
  Matrix3Xd first, sum;
  int count = 0;
  for (Index f = 0; f < markers.frames(); ++f) {
    const Matrix3Xd p = points(markers, group, f);
    if (!p.allFinite()) continue;
    if (count == 0) {
      first = p.colwise() - Eigen::Vector3d(p.rowwise().mean());
      sum = Matrix3Xd::Zero(3, p.cols());
    }
    const auto fit = fit_rigid(first, p);
    if (!fit) return refuse("its markers lie on a line");
    sum += fit->R_WB.transpose() * (p.colwise() - fit->p_WB);
    ++count;
  }
  if (count == 0) return refuse("its markers are never seen all together");
  return Matrix3Xd(sum / count);
}

std::vector<std::optional<RigidFit>> group_motion(const Markers& markers, const MarkerGroup& group,
                                                  const Matrix3Xd& nominal) {
  std::vector<std::optional<RigidFit>> motion;
  for (Index f = 0; f < markers.frames(); ++f) {
    motion.push_back(fit_rigid(nominal, points(markers, group, f)));
  }
  return motion;
}

// Normal equations of the stacked system [R_WA, −R_WB] (p_A; p_B) = p_WB − p_WA about the prior;
// eigenvectors with small eigenvalues are the directions of which the motion says nothing.
tl::expected<CentreOfRotation, Status> centre_of_rotation(
    std::span<const std::optional<RigidFit>> A, std::span<const std::optional<RigidFit>> B,
    const Eigen::Vector3d& prior_A, const Eigen::Vector3d& prior_B) {
  using Matrix6d = Eigen::Matrix<double, 6, 6>;
  using Vector6d = Eigen::Matrix<double, 6, 1>;
  constexpr double kLeastSingularValue = 0.06;
  Matrix6d normal = Matrix6d::Zero();
  Vector6d right = Vector6d::Zero();
  const std::size_t frames = std::min(A.size(), B.size());
  int count = 0;
  auto gap = [](const RigidFit& a, const RigidFit& b, const Eigen::Vector3d& p_A,
                const Eigen::Vector3d& p_B) -> Eigen::Vector3d {
    return a.R_WB * p_A + a.p_WB - b.R_WB * p_B - b.p_WB;
  };
  for (std::size_t f = 0; f < frames; ++f) {
    if (!A[f] || !B[f]) continue;
    Eigen::Matrix<double, 3, 6> rows;
    rows << A[f]->R_WB, -B[f]->R_WB;
    normal += rows.transpose() * rows;
    right -= rows.transpose() * gap(*A[f], *B[f], prior_A, prior_B);
    ++count;
  }
  if (count < 10) {
    return tl::unexpected(Status{"centre of rotation: both segments are seen in " +
                                 std::to_string(count) + " frames, expected at least 10"});
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(normal / count);
  CentreOfRotation centre;
  Vector6d step = Vector6d::Zero();
  for (int i = 0; i < 6; ++i) {
    if (eigen.eigenvalues()[i] < kLeastSingularValue * kLeastSingularValue) {
      ++centre.free_directions;
    } else {
      step += eigen.eigenvectors().col(i) *
              (eigen.eigenvectors().col(i).dot(right) / count / eigen.eigenvalues()[i]);
    }
  }
  if (centre.free_directions >= 3) {
    return tl::unexpected(
        Status{"centre of rotation: the segments hardly turn against each other"});
  }
  centre.p_A = prior_A + step.head<3>();
  centre.p_B = prior_B + step.tail<3>();
  double sum = 0.0;
  for (std::size_t f = 0; f < frames; ++f) {
    if (A[f] && B[f]) sum += gap(*A[f], *B[f], centre.p_A, centre.p_B).squaredNorm();
  }
  centre.rms_m = std::sqrt(sum / count);
  return centre;
}

}  // namespace mimesis::mocap
