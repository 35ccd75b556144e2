#pragma once
#include <Eigen/Core>

#include "common/motion/demix/grid_search.h"

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
  /// @param seed    of search()'s random delays
  GroupFit(Eigen::Index half, Eigen::Index sources, Eigen::Index group, Eigen::Index frozen,
           bool nonnegative, std::uint32_t seed = 1);

  void set_sources(const Eigen::MatrixXd& sources);  ///< 2·half × K

  /// The best weights (K×p, written) for the delays φ (K). @return e(φ) @param energy Σᵢ‖xᵢ‖²
  double weights(const double* x, double energy, const double* phi, double* w);

  /// Levenberg steps on e(φ) [variable projection after Kaufman]; φ and w are changed only if the
  /// error falls. @return e
  double refine(const double* x, double energy, double* phi, double* w, int steps);

  /// The τ-update over the whole period (GridSearch), then Levenberg steps. Kept only if the error
  /// falls. @param restarts  from random delays @return e
  double search(const double* x, double energy, double* phi, double* w, int restarts);

 private:
  void shift_all(const double* phi, bool derivative);
  void solve_weights(const double* x, double* w);
  double error(double energy, const double* w) const;
  void normal_equations(const double* x, const double* w);

  Eigen::Index half_, k_, p_, frozen_;
  bool nonnegative_;
  Eigen::MatrixXd sources_, z_, dz_;    ///< 2·half × K
  Eigen::MatrixXd gram_, factor_;       ///< ZᵀZ; its Cholesky factor, or of the others' (K−1)
  Eigen::MatrixXd y_;                   ///< ZᵀX, K×p
  Eigen::MatrixXd cross_, dgram_, dy_;  ///< dZᵀZ, dZᵀdZ, dZᵀX
  Eigen::MatrixXd moment_, curvature_, damped_, trial_w_, found_w_;
  Eigen::VectorXd slope_, step_, trial_phi_, found_;
  GridSearch grid_;
};

}  // namespace mimesis::demix
