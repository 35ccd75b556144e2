#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/motion/mocap/body.h"
#include "common/motion/retarget/to_body.h"

namespace mimesis::retarget {

/// Two seconds of a made-up walk at 100 Hz: sines in hips, knees, ankles and arms, travel at
/// `speed_m_s`. Its feet slide a little: they are not locked.
inline mocap::BodyClip made_up_walk(double speed_m_s = 1.1) {
  mocap::BodyClip clip;
  clip.body = mocap::standard_body();
  clip.name = "made-up";
  clip.rate_hz = 100.0;
  constexpr Eigen::Index kFrames = 200;
  clip.angles_rad = Eigen::MatrixXd::Zero(mocap::kBodyRows, kFrames);
  clip.root_position_W_m = Eigen::Matrix3Xd::Zero(3, kFrames);
  for (Eigen::Index t = 0; t < kFrames; ++t) {
    const double time = static_cast<double>(t) / clip.rate_hz;
    const double phase = 2.0 * std::numbers::pi * time / 1.1;
    const auto set = [&](int joint, int axis, double v) {
      clip.angles_rad(3 * joint + axis, t) = v;
    };
    for (const int side : {0, 1}) {
      const double p = phase + side * std::numbers::pi, sign = side == 0 ? 1.0 : -1.0;
      const int hip = side == 0 ? mocap::kLeftHip : mocap::kRightHip;
      const int shoulder = side == 0 ? mocap::kLeftShoulder : mocap::kRightShoulder;
      const double thigh = -0.27 * std::cos(p);
      const double knee = 0.12 + 0.9 * std::pow(std::max(0.0, -std::sin(p - 0.3)), 2.0);
      set(hip, 1, thigh);
      set(hip + 1, 1, knee);
      set(hip + 2, 1, -0.8 * (thigh + knee));
      set(shoulder, 0, -sign * 1.3);  // arms hang
      set(shoulder + 1, 2, -sign * (0.4 + 0.2 * std::cos(p)));
    }
    set(mocap::kChest, 2, 0.08 * std::sin(phase));
    clip.root_position_W_m.col(t) = Eigen::Vector3d(speed_m_s * time, 0.02 * std::sin(phase),
                                                    0.93 + 0.02 * std::cos(2 * phase));
  }
  return clip;
}

/// Heights above z = 0 of the lower point of a foot [m].
struct FootHeights {
  double standing_most = 0.0;  ///< largest |height| of a foot that stands
  double lowest = 1e9;         ///< height of the lowest foot
};
inline FootHeights foot_heights(const BodyMotion& motion) {
  const auto points = ground_points(motion.clip);
  FootHeights out;
  for (Eigen::Index t = 0; t < points.cols(); ++t) {
    for (const Eigen::Index side : {0, 1}) {
      const double low = std::min(points(6 * side + 2, t), points(6 * side + 5, t));
      out.lowest = std::min(out.lowest, low);
      if (!motion.contacts(2 * side, t) && !motion.contacts(2 * side + 1, t)) continue;
      out.standing_most = std::max(out.standing_most, std::abs(low));
    }
  }
  return out;
}

}  // namespace mimesis::retarget
