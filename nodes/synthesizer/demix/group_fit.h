#pragma once
#include <Eigen/Core>

namespace mimesis::demix {

/// The part of SISA that is done row by row, for a group of p trajectories that share their delays
/// (p = 1: free delays; all trials of one row: tied). Given the sources, the error
///   e(φ) = min_w Σᵢ ‖xᵢ − Σₖ wₖᵢ sₖ(t − φₖT/2π)‖²
/// is a function of the K delays alone: the weights are eliminated. Spectra as in spectrum.h.
/// Allocates in the constructor only. One thread at a time.
class GroupFit {
 public:
  /// @param half    of the spectra, a multiple of 4
  /// @param frozen  the first so many delays stay
  GroupFit(Eigen::Index half, Eigen::Index sources, Eigen::Index group, Eigen::Index frozen,
           bool nonnegative);

  void set_sources(const Eigen::MatrixXd& sources);  ///< 2·half × K

  /// The best weights (K×p, written) for the delays φ (K). @return e(φ) @param energy Σᵢ‖xᵢ‖²
  double weights(const double* x, double energy, const double* phi, double* w);

  /// Levenberg steps on e(φ) [variable projection after Kaufman]; φ and w are changed only if the
  /// error falls. @return e
  double refine(const double* x, double energy, double* phi, double* w, int steps);

  /// The τ-update [M18 3.3.3]: source after source, the delay on a grid that lets it take most of
  /// what the other ones leave, their weights fitted anew, pooled over the group:
  /// Σᵢ⟨rᵢ, sₖ(τ)⟩² / ‖P⊥sₖ(τ)‖². Kept only if the error falls. @return e
  double search(const double* x, double energy, double* phi, double* w);

 private:
  void shift_all(const double* phi, bool derivative);
  void solve_weights(const double* x, double* w);
  double error(double energy, const double* w) const;
  void normal_equations(const double* x, const double* w);
  Eigen::Index best_on_grid(const double* x, Eigen::Index k, const double* w);
  void add_correlation(const double* v, Eigen::Index k);

  Eigen::Index half_, k_, p_, frozen_;
  bool nonnegative_;
  Eigen::MatrixXd sources_, z_, dz_;    ///< 2·half × K
  Eigen::MatrixXd gram_, factor_;       ///< ZᵀZ; its Cholesky factor, or of the others' (K−1)
  Eigen::MatrixXd y_;                   ///< ZᵀX, K×p
  Eigen::MatrixXd cross_, dgram_, dy_;  ///< dZᵀZ, dZᵀdZ, dZᵀX
  Eigen::MatrixXd moment_, curvature_, damped_, trial_w_, basis_;
  Eigen::VectorXd slope_, step_, trial_phi_, before_;
  Eigen::MatrixXd table_;  ///< grid × 2·half
  Eigen::VectorXd product_, correlation_, gain_, room_, residual_;
};

}  // namespace mimesis::demix
