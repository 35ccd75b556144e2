#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <vector>

#include "common/motion/demix/group_fit.h"
#include "common/motion/demix/mixture.h"

namespace mimesis::demix {

struct Start {
  Eigen::MatrixXd sources;  ///< spectra, 2·half × count, unit columns
  bool search = true;       ///< delays are searched; false: they begin at 0
};

/// Starts for `count` sources of `data`. Free delays: harmonics 1..count [M18 3.3.3]: starts with
/// overtones or other harmonics were seen to end worse. Tied: weights have signs, so that two
/// sources of the same harmonic reach every phase of it, and how many harmonics deserve two is not
/// known beforehand; and the principal components.
/// @param by_energy  the strongest harmonics of the data instead of the lowest: for data that is
///   what given sources leave
std::vector<Start> starts(const Eigen::MatrixXd& data, Eigen::Index count, bool tied,
                          bool by_energy);

/// Anderson's acceleration of a fixed point iteration x ← g(x): the next x is the affine
/// combination of the last values g(xᵢ) whose residuals g(xᵢ) − xᵢ cancel best. [Walker & Ni 2011]
class Anderson {
 public:
  explicit Anderson(int memory) : memory_(static_cast<std::size_t>(memory)) {}
  /// @param x   where the iteration was @param gx  g(x), of the same size
  Eigen::MatrixXd next(const Eigen::MatrixXd& x, const Eigen::MatrixXd& gx);
  std::size_t size() const { return value_.size(); }  ///< values in memory
  void clear();

 private:
  std::size_t memory_;
  std::deque<Eigen::VectorXd> value_, residual_;
};

/// SISA's alternation [M18 eq. 3.8-3.10]. It lowers E = Σₙ‖xₙ − Σₖ wₙₖ sₖ(t − τₙₖ)‖² in turns; each
/// update is a function:
///   τ-update  φ = argmin of E with the weights eliminated, per group: search(), refine()
///   W-update  w = (ZᵀZ)⁻¹Zᵀx, Z the shifted sources, per group: with the τ-update (GroupFit)
///   S-update  A(f) s(f) = b(f) at every harmonic f, Aₖₗ = Σₙ wₙₖwₙₗ e^{if(φₙₖ−φₙₗ)},
///             bₖ = Σₙ wₙₖ e^{ifφₙₖ} xₙ(f): update_sources()
/// On spectra (spectrum.h): N trajectories in G groups of p, columns group after
/// group; the trajectories of a group share their delays. The first `frozen` sources and their
/// delays stay; weights are always fitted.
class Alternation {
 public:
  struct Layout {
    Eigen::Index groups = 1, group_size = 1, frozen = 0;
    bool nonnegative = false;
    std::uint32_t seed = 1;  ///< seed of the random delays
  };
  /// @param data  2·half × N
  Alternation(Eigen::MatrixXd data, const Layout& layout);

  /// Takes sources (2·half × K, unit columns) and delays (K×G) as they are and fits the weights.
  void start(const Eigen::MatrixXd& sources, const Eigen::MatrixXd& phi);
  /// τ-update over the whole period, also from `restarts` random delays, and W-update.
  void search(int restarts);
  void refine(int steps);  ///< τ-update by Levenberg steps, W-update
  void update_sources();   ///< S-update, sources scaled to unit norm; the error is known after the
                           ///< next τ- or W-update

  /// Turns of (τ, W, S), sped up by Anderson's extrapolation of the sources: an extrapolation that
  /// does not lower the error is undone. `trace`, if given, gets Q after each turn.
  struct Limits {
    int turns;         ///< at most
    int restarts;      ///< number of starts of each search for delays
    double tolerance;  ///< a turn that gains less of Q is the last
  };
  void run(const Limits& limits, std::vector<double>* trace);

  double error() const { return error_; }    ///< Σ‖x − x̂‖²
  double energy() const { return energy_; }  ///< Σ‖x‖²
  /// Energy that is in the data but not in `data`: the trace's Q counts it.
  void set_left_out(double energy) { left_out_ = energy; }
  double quality() const;
  Eigen::MatrixXd residual() const;  ///< x − x̂, as the data
  const Eigen::MatrixXd& sources() const { return sources_; }
  const Eigen::MatrixXd& phi() const { return phi_; }          ///< K×G
  const Eigen::MatrixXd& weights() const { return weights_; }  ///< K×N

 private:
  template <class Step>
  void each_group(const Step& step);
  void normal_matrices();
  void scale_sources();

  Layout layout_;
  Eigen::MatrixXd data_;
  Eigen::VectorXd energies_;  ///< per group
  double energy_ = 0.0, left_out_ = 0.0, error_ = 0.0;
  Eigen::MatrixXd sources_, phi_, weights_;
  std::vector<GroupFit> fit_;     ///< one, once the number of sources is known
  Eigen::MatrixXd pair_, right_;  ///< normal equations of the S-update: 2·half × K², 2·half × K
};

/// A mixture is equivalent if a source is scaled, negated or shifted and its weights and delays are
/// changed accordingly, or if sources change places. Among these equivalents, the sources after the
/// first `given` ones are normalised to: unit rms; the crest of the strongest harmonic at t = 0 (if
/// there are several, the one with the highest s(0)); signs with Σₙ wₙₖ ≥ 0, unless `keep_signs`;
/// the order of the energy they carry, most first. Delays are wrapped to [−π, π]; those without
/// weight are 0.
void fix_gauge(Mixture& mixture, Eigen::Index given, bool keep_signs);

}  // namespace mimesis::demix
