#pragma once
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "common/math/circle.h"
#include "common/motion/demix/mixture.h"
#include "nodes/synthesizer/character/parameters.h"

namespace mimesis::synthesizer {

inline Eigen::RowVectorXd wave(const std::vector<std::pair<int, double>>& harmonics,
                               int length = 100) {
  Eigen::RowVectorXd s(length);
  for (int t = 0; t < length; ++t) {
    s[t] = 0.0;
    for (const auto& [f, a] : harmonics) {
      s[t] += a * std::cos(math::kTwoPi * f * t / length + 0.4 * f);
    }
  }
  return s / std::sqrt(s.squaredNorm() / length);
}

inline Eigen::MatrixXd motion(const Eigen::MatrixXd& sources, const MotionParameters& p) {
  return demix::Mixture{sources, p.weight_rad, p.delay_rad, p.mean_rad, 0}.reconstruct();
}

/// Sources with every kind of ambiguity: any turn; a half turn with the sign; a third; a quarter
/// turn with the sign.
inline Eigen::MatrixXd ambiguous_sources() {
  Eigen::MatrixXd s(4, 100);
  s.row(0) = wave({{1, 1.0}, {2, 0.4}});
  s.row(1) = wave({{1, 1.0}, {3, 0.3}});
  s.row(2) = wave({{3, 1.0}, {6, 0.5}});
  s.row(3) = wave({{2, 1.0}, {6, 0.2}});
  return s;
}

inline MotionParameters some_motion() {
  MotionParameters p{Eigen::VectorXd::LinSpaced(5, -0.3, 0.4), Eigen::MatrixXd(5, 4),
                     Eigen::MatrixXd(5, 4), 6.0};
  for (int r = 0; r < 5; ++r) {
    for (int k = 0; k < 4; ++k) {
      p.weight_rad(r, k) = 0.3 * std::sin(1.0 + 2.3 * r + 1.1 * k);
      p.delay_rad(r, k) = 3.0 * std::sin(0.3 + 1.7 * r + 2.9 * k);
    }
  }
  return p;
}

/// An equal motion with other parameters.
inline MotionParameters disguised(MotionParameters p, int variant) {
  for (int r = 0; r < 5; ++r) {
    const int q = r + variant;
    p.delay_rad(r, 0) += math::kTwoPi * (q % 3 - 1);
    p.delay_rad(r, 1) += std::numbers::pi * q;
    if (q % 2) p.weight_rad(r, 1) *= -1.0;
    p.delay_rad(r, 2) += math::kTwoPi / 3.0 * q;
    p.delay_rad(r, 3) += std::numbers::pi / 2.0 * q;
    if (q % 2) p.weight_rad(r, 3) *= -1.0;
  }
  return p;
}

}  // namespace mimesis::synthesizer
