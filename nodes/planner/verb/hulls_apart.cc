#include "nodes/planner/verb/hulls_apart.h"

#include <Eigen/QR>
#include <algorithm>
#include <limits>

namespace mimesis::tool {
namespace {

using Eigen::Vector3d;
using Corners = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 4>;

/// The point of least norm in the hull of up to four corners, the last among them, and the corners
/// that it needs: the best of all subsets whose plane has it between them.
Vector3d least_norm(Corners& corners) {
  const Eigen::Index last = corners.cols() - 1;
  Corners best = corners.rightCols<1>();
  Vector3d point = best.col(0);
  for (int subset = 1; subset < 1 << last; ++subset) {
    Corners some(3, 0), edges(3, 0);
    for (Eigen::Index i = 0; i < last; ++i) {
      if ((subset >> i & 1) == 0) continue;
      some.conservativeResize(3, some.cols() + 1);
      some.rightCols<1>() = corners.col(i);
    }
    edges = some.colwise() - Vector3d(corners.col(last));
    Eigen::ColPivHouseholderQR<Corners> qr(edges);
    qr.setThreshold(1e-9);
    if (qr.rank() < edges.cols()) continue;  // in one plane: smaller subsets do
    const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 4, 1> weights =
        -qr.solve(Vector3d(corners.col(last)));
    if (weights.minCoeff() < 0.0 || weights.sum() > 1.0) continue;
    const Vector3d there = corners.col(last) + edges * weights;
    if (there.squaredNorm() >= point.squaredNorm()) continue;
    point = there;
    some.conservativeResize(3, some.cols() + 1);
    some.rightCols<1>() = corners.col(last);
    best = some;
  }
  corners = best;
  return point;
}

}  // namespace

Apart hulls_apart(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b, double near, double far,
                  Vector3d& normal) {
  constexpr double kExact = 1e-6;  // [m]
  constexpr int kMost = 60;
  // The corner of the difference that is nearest along a direction.
  const auto nearest = [&](const Vector3d& along) -> Vector3d {
    Eigen::Index i = 0, k = 0;
    (along.transpose() * a).minCoeff(&i);
    (along.transpose() * b).maxCoeff(&k);
    return a.col(i) - b.col(k);
  };
  Apart out{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  if (normal.isZero(0.0)) normal = (a.col(0) - b.col(0)).normalized();
  if (normal.isZero(0.0)) normal = Vector3d::UnitX();
  Vector3d corner = nearest(normal);
  out.at_least = normal.dot(corner);
  out.at_most = corner.norm();
  Corners corners = corner;
  Vector3d point = corner;
  for (int i = 0; i < kMost; ++i) {
    const double length = point.norm();
    out.at_most = std::min(out.at_most, length);
    if (length < kExact) out.at_least = std::max(out.at_least, 0.0);
    if (length < kExact || out.at_most <= near || out.at_least >= far ||
        out.at_most - out.at_least < kExact)
      return out;
    normal = point / length;
    corner = nearest(normal);
    out.at_least = std::max(out.at_least, normal.dot(corner));
    if (out.at_least >= far || out.at_most - out.at_least < kExact || corners.cols() == 4 ||
        (corners.colwise() - corner).colwise().squaredNorm().minCoeff() == 0.0)
      return out;  // known, or no better in double precision
    corners.conservativeResize(3, corners.cols() + 1);
    corners.rightCols<1>() = corner;
    point = least_norm(corners);
  }
  return out;
}

}  // namespace mimesis::tool
