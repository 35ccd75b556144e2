#pragma once
#include <Eigen/Core>

namespace mimesis::demix {

/// The anechoic mixture of N trajectories [M18 eq. 3.3, 3.8]:
///   ξₙ(t) = mₙ + Σₖ wₙₖ sₖ(t − τₙₖ),  t = 0..T−1, delays as phases φₙₖ = 2πτₙₖ/T.
/// Sources are periodic, but for the first `fixed` ones, which are given, not shifted (φ = 0), and
/// need not close (the non-periodic s₀(t) = cos(πt/T)).
struct Mixture {
  Eigen::MatrixXd sources;    ///< S, K×T, rows of unit rms [1]
  Eigen::MatrixXd weights;    ///< W, N×K [rad]
  Eigen::MatrixXd delay_rad;  ///< φ, N×K, in [−π, π]
  Eigen::VectorXd means;      ///< m, N [rad]
  int fixed = 0;

  Eigen::Index source_count() const { return sources.rows(); }
  Eigen::MatrixXd reconstruct() const;  ///< N×T, with means
};

/// Approximation quality against X, means removed from both. [M18 3.3.3] defines Q under fig. 3.10
/// and the squared Q2 under fig. 3.13; they differ a lot, so every figure names which one it is.
double quality(const Eigen::MatrixXd& x, const Eigen::MatrixXd& x_hat);  ///< Q = 1 − ‖X−X̂‖/‖X‖
double quality_squared(const Eigen::MatrixXd& x,
                       const Eigen::MatrixXd& x_hat);  ///< Q2 = 1 − ‖·‖²/‖·‖²

}  // namespace mimesis::demix
