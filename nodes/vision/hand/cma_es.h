#pragma once
#include <cstdint>
#include <random>
#include <span>
#include <vector>

namespace mimesis::vision {

/// Minimiser by evolution strategy with covariance matrix adaptation (Hansen, "The CMA evolution
/// strategy: a tutorial", arXiv:1604.00772, with a Cholesky factor in the place of the eigenvalue
/// decomposition; then the path of the step size uses the normal deviates themselves, as in Krause
/// et al. 2016). Coordinates are to be scaled so that steps of 1 matter about equally. Seeded; does
/// not allocate after construction.
class CmaEs {
 public:
  CmaEs(int dimensions, int population, std::uint64_t seed);

  /// Begins a search at `mean` with steps `sigma`; the covariance matrix is the identity.
  void start(std::span<const double> mean, double sigma);
  /// Begins a search with the covariance found by the ones before, blended with the identity by
  /// `forget` (0..1): the shape of the valley changes slowly from picture to picture.
  void resume(std::span<const double> mean, double sigma, double forget);

  /// Draws the next generation.
  void ask();
  int population() const { return lambda_; }
  std::span<const double> candidate(int k) const { return row(x_, k); }
  /// Takes the costs of the candidates, in their order.
  void tell(std::span<const double> cost);

  std::span<const double> mean() const { return mean_; }
  double sigma() const { return sigma_; }

 private:
  std::span<const double> row(const std::vector<double>& m, int k) const {
    return std::span(m).subspan(static_cast<std::size_t>(k) * n_, n_);
  }
  void begin(std::span<const double> mean, double sigma);
  void factorize();

  std::size_t n_;
  int lambda_, mu_;
  std::mt19937_64 random_;
  std::vector<double> weights_, deviates_;
  double mu_eff_, c_sigma_, d_sigma_, c_c_, c_1_, c_mu_, chi_n_;
  std::vector<double> mean_, path_c_, path_sigma_, covariance_, factor_;
  std::vector<double> z_, y_, x_;  ///< deviates, steps and places of a generation, row by row
  std::vector<double> mean_z_, mean_y_;
  std::vector<int> order_;
  double sigma_ = 1.0;
  int generation_ = 0;
};

}  // namespace mimesis::vision
