#pragma once
#include <Eigen/Core>
#include <vector>

#include "common/motion/model/motion_model.h"

namespace mimesis::synthesizer {

/// Settings of the ε-insensitive support vector regression. Values are in units of the source (rms
/// 1).
struct SvrSettings {
  double gamma = 5.0;       ///< kernel exp(−γ|x − y|²); states lie on the unit circle
  double cost = 1000.0;     ///< C: weight of errors beyond ε
  double epsilon = 1e-4;    ///< errors up to this are free
  double tolerance = 1e-5;  ///< where the solver stops
};

/// f(x) = Σᵢ aᵢ exp(−γ|x − xᵢ|²) + b: the map from an oscillator's state to a source's value,
/// learned by support vector regression [M18 3.3.4; LIBSVM]. It is defined by the state: off the
/// limit cycle it interpolates and, far away, falls to b.
class SourceMap {
 public:
  /// @param states  2×n, near the unit circle (Θx of the uncoupled oscillator's limit cycle);
  /// @param values  n, of the source at the same times. Deterministic.
  /// @throws ConfigError for empty or unequal or non-finite data, settings that are not positive.
  SourceMap(const Eigen::Matrix2Xd& states, const Eigen::VectorXd& values,
            const SvrSettings& settings = {});

  double operator()(const Eigen::Vector2d& state) const;  ///< O(support vectors), no allocation

 private:
  Eigen::Matrix2Xd centre_;
  Eigen::VectorXd factor_;
  double gamma_, offset_ = 0.0;
};

/// A delay as a rotation in the phase plane [M18 eq. 3.14, 3.15]: s(t − τ) ≈ f(M x) with the
/// rotation by −φ, φ = 2πτ/T, for states that run counterclockwise.
inline Eigen::Vector2d delayed(const Eigen::Vector2d& state, double cos_phi, double sin_phi) {
  return {cos_phi * state[0] + sin_phi * state[1], cos_phi * state[1] - sin_phi * state[0]};
}

/// One map per source of the model, learned at the samples' phases. The fixed, non-periodic sources
/// are learned over (cos φ/2, sin φ/2), half a circle.
std::vector<SourceMap> learn_source_maps(const motion::MotionModel& model,
                                         const SvrSettings& settings = {});

}  // namespace mimesis::synthesizer
