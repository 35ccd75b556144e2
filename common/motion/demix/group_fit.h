#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace mimesis::demix {

/// Looks for delays over the whole period, on a grid: the τ-update [M18 3.3.3] for a group of p
/// trajectories. Correlations of the data with each source and of the sources with each other are
/// formed once; after that each trial of K delays is looked up: source after source takes the place
/// where, with all weights fitted again, it explains most, Σᵢ⟨rᵢ, sₖ(τ)⟩² / ‖P⊥sₖ(τ)‖², pooled over
/// the group; from the present delays and from random ones. The look-up is in single precision.
/// Allocates in the constructor only.
class GridSearch {
 public:
  /// @param seed  of the random delays
  GridSearch(Eigen::Index half, Eigen::Index sources, Eigen::Index group, Eigen::Index frozen,
             bool nonnegative, std::uint32_t seed);
  void set_sources(const Eigen::MatrixXd& sources);  ///< spectra, 2·half × K

  /// Writes the best delays found for the trajectories x (2·half × p) into `found` (K); the first
  /// `frozen` are copied from `phi`. @return false if these are those of the grid nearest to `phi`.
  bool propose(const double* x, const double* phi, int restarts, double* found);

 private:
  void correlate_data(const double* x);
  void descend(Eigen::VectorXi& place);
  void best_place(Eigen::VectorXi& place, Eigen::Index k, bool& moved);
  float explained(const Eigen::VectorXi& place);
  float gram(Eigen::Index k, Eigen::Index l, const Eigen::VectorXi& place) const;
  int nearest(double phi) const;

  Eigen::Index half_, k_, p_, frozen_, grid_;
  bool nonnegative_;
  Eigen::VectorXd angles_;           ///< angles in the order of correlate()
  Eigen::MatrixXd table_;            ///< table of correlate()
  std::vector<Eigen::Index> order_;  ///< rising order of these angles
  Eigen::MatrixXd sources_;
  Eigen::VectorXd product_, mirrored_;
  Eigen::MatrixXf between_;          ///< 2·grid × K², of τₖ − τₗ
  Eigen::MatrixXf with_data_;        ///< grid × K·p
  Eigen::VectorXf scratch_;          ///< scratch memory of best_gain()
  Eigen::MatrixXf factor_, weight_;  ///< Cholesky factor of the other sources, L⁻¹y
  std::vector<const float*> others_;
  Eigen::VectorXi place_, best_;
  std::uint32_t random_;
};

/// The part of SISA that is done row by row, for a group of p trajectories that share their delays
/// (p = 1: free delays; all trials of one row: tied). Given the sources, the error
///   e(φ) = min_w Σᵢ ‖xᵢ − Σₖ wₖᵢ sₖ(t − φₖT/2π)‖²
/// is a function of the K delays alone: the weights are eliminated. Spectra as in spectrum.h.
/// Allocates in the constructor only. One thread at a time.
class GroupFit {
 public:
  /// @param half    of the spectra, a multiple of 4
  /// @param frozen  number of first delays that stay
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
