#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>

#include "common/math/so3.h"
#include "common/motion/mocap/clip_file.h"

namespace mimesis::mocap {

/// Motion files are y up, facing +z, left +x; this project is z up, facing +x, left +y. So the axes
/// permute, (x, y, z)_project = (z, x, y)_file, for points, axes and axis-angle vectors alike.
inline Eigen::Vector3d from_file_axes(const Eigen::Vector3d& v) { return {v.z(), v.x(), v.y()}; }
inline Eigen::Vector3d to_file_axes(const Eigen::Vector3d& v) { return {v.y(), v.z(), v.x()}; }
/// 0, 1, 2 = x, y, z of the file -> the same axis in this project.
inline int from_file_axis(int axis) { return (axis + 1) % 3; }

inline constexpr double kRadians = std::numbers::pi / 180.0;  ///< one degree in radians

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

/// A clip must not need more memory than its file justifies: a joint moved in one frame is 24 bytes
/// in a clip and two or more in a file, and joints that the file does not move are few.
/// @throws ConfigError
void check_clip_size(const std::string& file, std::size_t file_bytes, std::size_t joints,
                     std::size_t frames);

/// No person is as large or goes as far as 10 km: such lengths overflow in later computations.
/// @throws ConfigError
void check_lengths(const std::string& file, const Clip& clip);

/// @throws ConfigError
void check_options(const ReadOptions& options);

/// Appends a number with this number of decimals, with equal bytes in every locale.
inline void append_fixed(std::string& text, double value, int decimals) {
  char digits[400];
  const auto end =
      std::to_chars(digits, digits + sizeof digits, value, std::chars_format::fixed, decimals);
  text.append(digits, end.ptr);
}

/// Appends the shortest text that reads as the same number.
inline void append_exact(std::string& text, double value) {
  char digits[32];
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

/// Checks that a clip can be written: joints with parents before them, sizes that fit, finite
/// numbers.
/// @throws ConfigError
void check_writable(const Clip& clip);

}  // namespace mimesis::mocap
