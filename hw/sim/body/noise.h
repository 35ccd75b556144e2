#pragma once
#include <Eigen/Geometry>
#include <random>

namespace mimesis::hw::sim {

/// Errors of sensors; the same for the same seed.
class Noise {
 public:
  /// `tilt_rad`: bound of the attitude's error
  Noise(std::uint64_t seed, double tilt_rad);

  /// Normal with deviation 1.
  double normal();
  /// Error of the attitude at a time: about x and y of W, slow and smooth (0.05 to 0.4 Hz), at most
  /// `tilt_rad` about each.
  Eigen::Quaterniond tilt(double time_s) const;

 private:
  struct Wave {
    double frequency_hz, phase_rad;
  };
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  double tilt_rad_;
  Wave wave_[2][2];
};

}  // namespace mimesis::hw::sim
