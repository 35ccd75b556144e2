#include "hw/sim/body/noise.h"

#include <cmath>
#include <numbers>

namespace mimesis::hw::sim {

Noise::Noise(std::uint64_t seed, double tilt_rad) : random_(seed), tilt_rad_(tilt_rad) {
  std::uniform_real_distribution<double> phase(0.0, 2.0 * std::numbers::pi), slow(0.05, 0.15),
      fast(0.2, 0.4);
  for (auto& axis : wave_) {
    axis[0] = {slow(random_), phase(random_)};
    axis[1] = {fast(random_), phase(random_)};
  }
}

double Noise::normal() { return normal_(random_); }

Eigen::Quaterniond Noise::tilt(double time_s) const {
  Eigen::Vector3d error = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 2; ++axis) {
    for (const Wave& wave : wave_[axis]) {
      error[axis] += 0.5 * tilt_rad_ *
                     std::sin(2.0 * std::numbers::pi * wave.frequency_hz * time_s + wave.phase_rad);
    }
  }
  return Eigen::AngleAxisd(error.y(), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(error.x(), Eigen::Vector3d::UnitX());
}

}  // namespace mimesis::hw::sim
