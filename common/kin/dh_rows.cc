#include "common/kin/dh_rows.h"

#include <cmath>

namespace mimesis::kin {
namespace {

constexpr double kParallel = 1e-9;  // sine of the angle between axes

/// Angle that turns `from` to `to` about `axis`, to which both are normal.
double angle_about(const Eigen::Vector3d& axis, const Eigen::Vector3d& from,
                   const Eigen::Vector3d& to) {
  return std::atan2(axis.dot(from.cross(to)), from.dot(to));
}

Eigen::Isometry3d frame(const Eigen::Vector3d& origin, const Eigen::Vector3d& x,
                        const Eigen::Vector3d& z) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() << x, z.cross(x), z;
  X.translation() = origin;
  return X;
}

}  // namespace

DhRows dh_rows(std::span<const JointAxis> axes) {
  DhRows rows;
  Eigen::Vector3d origin = axes[0].point, z = axes[0].direction, x = z.unitOrthogonal();
  rows.frames.push_back(frame(origin, x, z));
  for (std::size_t i = 0; i < axes.size(); ++i) {
    // The last frame stays on its own axis.
    const JointAxis& next = axes[std::min(i + 1, axes.size() - 1)];
    const Eigen::Vector3d between = next.point - origin, cross = z.cross(next.direction);
    Eigen::Vector3d foot = origin, there = origin, normal = x;
    if (const double sine = cross.norm(); sine > kParallel) {
      normal = cross / sine;
      foot += z * between.cross(next.direction).dot(normal) / sine;
      there = next.point + next.direction * between.cross(z).dot(normal) / sine;
    } else if (const Eigen::Vector3d off = between - z * z.dot(between); off.norm() > kParallel) {
      normal = off.normalized();
      there += off;
    }
    rows.links.push_back({.a = (there - foot).dot(normal),
                          .alpha = angle_about(normal, z, next.direction),
                          .d = (foot - origin).dot(z),
                          .offset = angle_about(z, x, normal),
                          .slides = axes[i].slides});
    origin = there;
    z = next.direction;
    x = normal;
    rows.frames.push_back(frame(origin, x, z));
  }
  return rows;
}

}  // namespace mimesis::kin
