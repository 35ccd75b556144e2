#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace mimesis::demix {

/// Looks for delays over the whole period, on a grid: the τ-update [M18 3.3.3] for a group of p
/// trajectories. Correlations of the data with each source and of the sources with each other are
/// formed once; after that each trial of K delays is looked up: source after source takes the place
/// where, with the weights of all fitted anew, it explains most, Σᵢ⟨rᵢ, sₖ(τ)⟩² / ‖P⊥sₖ(τ)‖²,
/// pooled over the group; from the present delays and from random ones. The look-up is in single
/// precision. Allocates in the constructor only.
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
  Eigen::VectorXd angles_;           ///< as correlate() has them
  Eigen::MatrixXd table_;            ///< of correlate()
  std::vector<Eigen::Index> order_;  ///< of these angles, rising
  Eigen::MatrixXd sources_;
  Eigen::VectorXd product_, mirrored_;
  Eigen::MatrixXf between_;          ///< 2·grid × K², of τₖ − τₗ
  Eigen::MatrixXf with_data_;        ///< grid × K·p
  Eigen::VectorXf scratch_;          ///< of best_gain()
  Eigen::MatrixXf factor_, weight_;  ///< of the others: Cholesky factor, L⁻¹y
  std::vector<const float*> others_;
  Eigen::VectorXi place_, best_;
  std::uint32_t random_;
};

}  // namespace mimesis::demix
