#include "experiments/motion/avatar_network.h"

#include <cmath>

#include "common/math/circle.h"

namespace mimesis::synthesizer {
namespace {

/// Weakly nonlinear: the limit cycle is a circle within 2 % [M18 3.3.4], and attracts within a few
/// cycles.
std::vector<VanDerPol> oscillators(std::size_t count, double duration_s) {
  const double omega = math::kTwoPi / duration_s;
  return std::vector<VanDerPol>(count, {.nu = 0.4 * omega, .rho = 0.25, .omega_rad_s = omega});
}

}  // namespace

AvatarNetwork::AvatarNetwork(const Pattern& pattern, const std::vector<SourceMap>& maps,
                             double internal_1_s, double phase_rad, double dt_s)
    : pattern_(pattern),
      cos_(pattern.delay_rad.array().cos()),
      sin_(pattern.delay_rad.array().sin()),
      network_(oscillators(maps.size(), pattern.trial.duration_s),
               all_to_all(static_cast<int>(maps.size()), internal_1_s), dt_s),
      maps_(maps) {
  for (int k = 0; k < size(); ++k) network_.set_phase(k, phase_rad);
}

void AvatarNetwork::follow(const AvatarNetwork& leader, double strength_1_s) {
  network_.set_external(0, leader.network_.state(0), strength_1_s);
}

void AvatarNetwork::step() { network_.step(); }

Eigen::VectorXd AvatarNetwork::mix(const Eigen::Matrix2Xd& circle) const {
  Eigen::VectorXd xi = pattern_.mean_rad;
  for (Eigen::Index k = 0; k < circle.cols(); ++k) {
    for (Eigen::Index r = 0; r < xi.size(); ++r) {
      xi[r] += pattern_.weight_rad(r, k) *
               maps_[static_cast<std::size_t>(k)](delayed(circle.col(k), cos_(r, k), sin_(r, k)));
    }
  }
  return xi;
}

Eigen::VectorXd AvatarNetwork::angles() const {
  Eigen::Matrix2Xd circle(2, size());
  for (int k = 0; k < size(); ++k) circle.col(k) = network_.circle(k);
  return mix(circle);
}

Eigen::VectorXd AvatarNetwork::angles_at(double phase_rad) const {
  const Eigen::Vector2d u(std::cos(phase_rad), std::sin(phase_rad));
  return mix(u.replicate(1, size()));
}

}  // namespace mimesis::synthesizer
