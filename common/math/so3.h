#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "common/math/circle.h"

namespace mimesis::math {

/// ŵ with ŵ·v = w × v. [M18 eq. 3.1]
inline Eigen::Matrix3d hat(const Eigen::Vector3d& w) {
  Eigen::Matrix3d m;
  m << 0.0, -w.z(), w.y(), w.z(), 0.0, -w.x(), -w.y(), w.x(), 0.0;
  return m;
}

/// Rotation of an axis-angle vector θw [rad] (exponential map, Rodrigues). [M18 eq. 3.2]
inline Eigen::Matrix3d exp_so3(const Eigen::Vector3d& axis_angle) {
  const double theta2 = axis_angle.squaredNorm(), theta = std::sqrt(theta2);
  // below 1e-4 rad the series is exact to the last bit
  const double a = theta < 1e-4 ? 1.0 - theta2 / 6.0 : std::sin(theta) / theta;
  const double b = theta < 1e-4 ? 0.5 - theta2 / 24.0 : (1.0 - std::cos(theta)) / theta2;
  const Eigen::Matrix3d w = hat(axis_angle);
  return Eigen::Matrix3d::Identity() + a * w + b * (w * w);
}

/// Axis-angle vector of a rotation (unit quaternion), of length in [0, π] rad; at π the sign of the
/// axis is arbitrary.
inline Eigen::Vector3d log_so3(Eigen::Quaterniond q) {
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  const double s = q.vec().norm();
  if (s < 1e-10) return 2.0 * q.vec();
  return (2.0 * std::atan2(s, q.w()) / s) * q.vec();
}

/// Rotation vector of a matrix, computed by the quaternion, so that it is accurate at both ends.
inline Eigen::Vector3d log_so3(const Eigen::Matrix3d& rotation) {
  return log_so3(Eigen::Quaterniond(rotation));
}

/// Rotation by the smallest angle that turns `from` into the direction of `to`, neither zero.
/// Within 1.5e-6 rad of a half turn it is one, about an axis perpendicular to `from`. Eigen's
/// FromTwoVectors finds that axis by a singular value decomposition, which costs 10 s to compile.
inline Eigen::Matrix3d rotation_onto(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = from.normalized(), b = to.normalized();
  const double cosine = b.dot(a);
  Eigen::Quaterniond q;
  if (cosine < -1.0 + 1e-12) {
    q.w() = 0.0;
    q.vec() = a.cross(Eigen::Vector3d::Unit(std::abs(a.y()) < 0.9 ? 1 : 0)).normalized();
  } else {
    const double s = std::sqrt((1.0 + cosine) * 2.0);
    q.w() = s * 0.5;
    q.vec() = a.cross(b) * (1.0 / s);
  }
  return q.toRotationMatrix();
}

/// Rz(yaw) Ry(pitch) Rx(roll), as in a URDF [rad].
inline Eigen::Matrix3d rotation_of_rpy(const Eigen::Vector3d& rpy) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  return (AngleAxisd(rpy.z(), Vector3d::UnitZ()) * AngleAxisd(rpy.y(), Vector3d::UnitY()) *
          AngleAxisd(rpy.x(), Vector3d::UnitX()))
      .matrix();
}

/// The angles of rotation_of_rpy() with the pitch within ±π/2 [rad]; at its ends the roll is 0.
inline Eigen::Vector3d rpy_of(const Eigen::Matrix3d& R) {
  const double across = std::hypot(R(0, 0), R(1, 0)), pitch = std::atan2(-R(2, 0), across);
  if (across < 1e-12) return {0.0, pitch, std::atan2(-R(0, 1), R(1, 1))};
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

/// Heading: angle about z from x to where the x axis of the rotation points, in [−π, π] rad.
inline double yaw_of(const Eigen::Matrix3d& R) { return std::atan2(R(1, 0), R(0, 0)); }

/// The axis-angle vector of the same rotation that is nearest to `reference`: what removes the
/// jumps by 2π from a trajectory [M18 3.3.2]. Where axis_angle is (nearly) zero the axis of
/// `reference` counts.
inline Eigen::Vector3d nearest_axis_angle(const Eigen::Vector3d& axis_angle,
                                          const Eigen::Vector3d& reference) {
  const double theta = axis_angle.norm();
  const Eigen::Vector3d axis =
      theta > 1e-9 ? Eigen::Vector3d(axis_angle / theta) : reference.normalized();
  return (theta + kTwoPi * std::round((axis.dot(reference) - theta) / kTwoPi)) * axis;
}

}  // namespace mimesis::math
