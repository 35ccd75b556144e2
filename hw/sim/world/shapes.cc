#include "hw/sim/world/shapes.h"

#include <algorithm>
#include <cmath>

namespace mimesis::world {
namespace {

/// From the distances along independent directions, each negative inside.
double combine(double a, double b) {
  if (a <= 0.0 && b <= 0.0) return std::max(a, b);
  return std::hypot(std::max(a, 0.0), std::max(b, 0.0));
}

}  // namespace

double signed_distance(const kin::Box& box, const Eigen::Vector3d& p) {
  const Eigen::Vector3d d = (p - box.center).cwiseAbs() - box.half_extent;
  return d.maxCoeff() <= 0.0 ? d.maxCoeff() : d.cwiseMax(0.0).norm();
}

double signed_distance(const Cylinder& cylinder, const Eigen::Vector3d& p) {
  const Eigen::Vector3d p_O = cylinder.X_WO.inverse() * p;
  return combine(p_O.head<2>().norm() - cylinder.radius, std::abs(p_O.z()) - cylinder.height / 2);
}

double tilt(const Cylinder& cylinder) {
  const Eigen::Vector3d axis = cylinder.X_WO.linear().col(2);
  return std::atan2(axis.head<2>().norm(), std::abs(axis.z()));
}

double lowest_point(const Cylinder& cylinder) {
  const double theta = tilt(cylinder);
  return cylinder.X_WO.translation().z() - cylinder.height / 2 * std::cos(theta) -
         cylinder.radius * std::sin(theta);
}

std::vector<kin::Ball> covering_balls(const Cylinder& cylinder) {
  constexpr int kAlongAxis = 5, kOnRim = 12;
  std::vector<kin::Ball> balls;
  const double half = std::max(cylinder.height / 2 - cylinder.radius, 0.0);
  for (int i = 0; i < kAlongAxis; ++i) {
    const double z = half * (2.0 * i / (kAlongAxis - 1) - 1.0);
    balls.push_back({cylinder.X_WO * Eigen::Vector3d(0, 0, z), cylinder.radius});
  }
  for (const double z : {-cylinder.height / 2, cylinder.height / 2}) {
    for (int i = 0; i < kOnRim; ++i) {
      const double phi = 2.0 * M_PI * i / kOnRim;
      const Eigen::Vector3d rim(cylinder.radius * std::cos(phi), cylinder.radius * std::sin(phi),
                                z);
      balls.push_back({cylinder.X_WO * rim, 0.0});
    }
  }
  return balls;
}

}  // namespace mimesis::world
