#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "common/math/so3.h"

namespace mimesis::mocap {

/// Motion files are y up, facing +z, left +x; the house is z up, facing +x, left +y. So the axes
/// permute, (x, y, z)_house = (z, x, y)_file, for points, axes and axis-angle vectors alike.
inline Eigen::Vector3d from_file_axes(const Eigen::Vector3d& v) { return {v.z(), v.x(), v.y()}; }
inline Eigen::Vector3d to_file_axes(const Eigen::Vector3d& v) { return {v.y(), v.z(), v.x()}; }
/// 0, 1, 2 = x, y, z of the file -> the same axis in the house.
inline int from_file_axis(int axis) { return (axis + 1) % 3; }

/// Rotation by an angle [rad] about coordinate axis 0, 1 or 2.
inline Eigen::Quaterniond turn_about(int axis, double angle_rad) {
  Eigen::Quaterniond q(std::cos(0.5 * angle_rad), 0.0, 0.0, 0.0);
  q.vec()[axis] = std::sin(0.5 * angle_rad);
  return q;
}

/// Writes the axis-angle vector of `rotation` into rows 3j..3j+2 of a column: the one nearest to
/// that of the column before, in column 0 the one nearest to zero (of length <= π).
template <typename Matrix>
void put_rotation(Matrix& rotation_rad, Eigen::Index joint, Eigen::Index frame,
                  const Eigen::Quaterniond& rotation) {
  const Eigen::Vector3d v = math::log_so3(rotation);
  auto block = rotation_rad.template block<3, 1>(3 * joint, frame);
  if (frame == 0) {
    block = v;
  } else {
    block = math::nearest_axis_angle(v, rotation_rad.template block<3, 1>(3 * joint, frame - 1));
  }
}

}  // namespace mimesis::mocap
