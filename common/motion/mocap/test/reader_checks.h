#pragma once
#include <numbers>
#include <string>

#include "common/math/so3.h"
#include "common/motion/mocap/body.h"
#include "common/testing/refusal.h"

namespace mimesis::mocap {

/// Message with which a call refuses its input, "" if it accepts it.
template <typename Call>
std::string message_of(const Call& call) {
  return testing::refusal([&] { call(); });
}

inline constexpr double kDeg = std::numbers::pi / 180.0;

inline Eigen::Matrix3d rotation(const Clip& clip, int joint, Eigen::Index frame) {
  return math::exp_so3(clip.rotation_rad.block<3, 1>(3 * joint, frame));
}

// Axes of the file: y, z, x of this project.
inline Eigen::Matrix3d rx(double deg) { return math::exp_so3(Eigen::Vector3d(0, deg * kDeg, 0)); }
inline Eigen::Matrix3d ry(double deg) { return math::exp_so3(Eigen::Vector3d(0, 0, deg * kDeg)); }
inline Eigen::Matrix3d rz(double deg) { return math::exp_so3(Eigen::Vector3d(deg * kDeg, 0, 0)); }

}  // namespace mimesis::mocap
