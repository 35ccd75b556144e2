#include "common/motion/mocap/test/walker.h"

#include <cmath>

#include "common/math/circle.h"

namespace mimesis::mocap {

BodyClip walk(const Walker& w) {
  BodyClip clip;
  clip.body = standard_body();
  clip.name = "walker.bvh";
  clip.rate_hz = w.rate_hz;
  const auto frames = static_cast<Eigen::Index>(std::lround(w.seconds * w.rate_hz));
  clip.angles_rad = Eigen::MatrixXd::Zero(kBodyRows, frames);
  clip.root_position_W_m.resize(3, frames);
  Eigen::Vector3d root(0.0, 0.0, 0.95);
  for (Eigen::Index f = 0; f < frames; ++f) {
    const double t = static_cast<double>(f) / w.rate_hz;
    const double heading = w.heading_rad + w.turn_rad_s * t;
    const double swing = w.swing_rad * std::cos(math::kTwoPi * t / w.period_s + w.start_phase_rad);
    clip.root_position_W_m.col(f) = root;
    root += Eigen::Vector3d(std::cos(heading), std::sin(heading), 0.0) * w.speed_m_s / w.rate_hz;
    clip.angles_rad(3 * kRoot + 2, f) = heading;
    // a leg swings forward about −y
    clip.angles_rad(3 * kLeftHip + 1, f) = -swing;
    clip.angles_rad(3 * kLeftAnkle + 1, f) = swing;
    clip.angles_rad(3 * kRightHip + 1, f) = swing;
    clip.angles_rad(3 * kRightAnkle + 1, f) = -swing;
  }
  return clip;
}

}  // namespace mimesis::mocap
