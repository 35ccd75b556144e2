#include "common/robot/axes.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

namespace mimesis::robot {

std::optional<Eigen::Vector3d> meeting_point(std::span<const Line> lines, double tolerance_m) {
  // Least squares of the distances: Σ (1 − d dᵀ)(x − p) = 0
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const Line& line : lines) {
    const Eigen::Matrix3d across =
        Eigen::Matrix3d::Identity() - line.direction * line.direction.transpose();
    A += across;
    b += across * line.point;
  }
  if (A.determinant() < 1e-9) return {};
  const Eigen::Vector3d x = A.ldlt().solve(b);
  for (const Line& line : lines) {
    if (line.direction.cross(x - line.point).norm() > tolerance_m) return {};
  }
  return x;
}

}  // namespace mimesis::robot
