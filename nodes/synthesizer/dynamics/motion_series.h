#pragma once
#include <Eigen/Core>

#include "common/motion/model/motion_model.h"

namespace mimesis::synthesizer {

/// Turns a model's mixture ξᵣ(φ) = mᵣ + Σₖ wᵣₖ sₖ(φ − φᵣₖ) [M18 eq. 3.3, 3.14] into one Fourier
/// series per row, which costs the same for any number of sources:
///   ξᵣ(φ) = c + Σₕ₌₁..H (aₕ cos hφ + bₕ sin hφ) + d₁ cos φ/2 + d₂ sin φ/2 + d₃ cos φ/4 + d₄ sin
///   φ/4,
/// φ in [0, 2π). The last four are there if the model has fixed sources, which need not close:
/// s₀ = cos(φ/2) and its companions are combinations of them, what remains of others is taken as
/// periodic. Sources are band-limited between their samples; their Nyquist bin is dropped.
///
/// A series is an array of floats: basis_count() blocks of row_stride() values, block b the factors
/// of basis function b for all rows (1, cos φ, sin φ, cos 2φ, ..., the slow ones; zeros up to the
/// next multiple of 4).
class MotionSeries {
 public:
  /// @param harmonics  H in [1, (T − 1)/2]; 0: the smallest H whose truncation_rad() is below
  ///                   tolerance_rad for all patterns of the model
  /// @throws ConfigError for a model without sources, rows or patterns, or with sizes that do not
  ///         fit.
  MotionSeries(const motion::MotionModel& model, int harmonics, double tolerance_rad);

  int rows() const { return rows_; }                         ///< R
  int sources() const { return int(source_.rows()); }        ///< K
  int harmonics() const { return harmonics_; }               ///< H
  int slow_functions() const { return fixed_ > 0 ? 4 : 0; }  ///< cos φ/2 ... sin φ/4
  int basis_count() const { return basis_; }                 ///< multiple of 4
  int row_stride() const { return stride_; }                 ///< R rounded up to a multiple of 16
  int size() const { return basis_ * stride_; }              ///< floats of one series
  /// Largest error of a joint-level value against the untruncated sources, over the model's
  /// patterns [rad]: an upper bound, the sum of the omitted terms.
  double truncation_rad() const { return truncation_rad_; }

  /// Writes the series of one parameter set to `series`, size() floats. Some µs; does not allocate.
  /// @param mean_rad m, R;  @param weight_rad w, R×K;  @param delay_rad φ, R×K (of fixed sources 0)
  void make(const Eigen::Ref<const Eigen::VectorXd>& mean_rad,
            const Eigen::Ref<const Eigen::MatrixXd>& weight_rad,
            const Eigen::Ref<const Eigen::MatrixXd>& delay_rad, float* series) const;

  /// Writes a series as a table: `samples` rows a period of row_stride() floats, at the phases
  /// 2πj/samples, j = −1..samples + 1 (the slow functions continued): samples + 3 rows. In between
  /// goes the cubic through four rows. Does not allocate.
  void tabulate(const float* series, int samples, float* table) const;

 private:
  /// truncation_rad() of a pattern for H = 0 up to the largest: Σₕ |Σₖ wₖ Cₖₕ e^{−ihφₖ}| of the
  /// omitted terms, of the row where it is largest.
  Eigen::ArrayXd truncations(const motion::Pattern& pattern) const;

  int rows_ = 0, harmonics_ = 0, basis_ = 0, stride_ = 0, fixed_ = 0;
  double truncation_rad_ = 0.0;
  Eigen::MatrixXd source_;  ///< K×(1 + 2·Hmax): 1, cos φ, sin φ, ...
  Eigen::MatrixXd slow_;    ///< fixed×4
};

}  // namespace mimesis::synthesizer
