#include "experiments/dmp/andronov_hopf.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "common/math/integrator.h"

namespace mimesis::dmp {
namespace {

using Eigen::Vector2d;

TEST(AndronovHopf, RadiusAndPhaseFollowTheClosedForm) {
  const AndronovHopf oscillator{7.0};
  const auto f = [&](double, const Vector2d& x) { return oscillator.rate(x); };
  constexpr double kDt = 1e-3;
  for (const double r0 : {0.2, 3.0}) {
    Vector2d x(0.0, r0);
    for (int n = 1; n <= 2000; ++n) {
      x = math::rk4_step(f, 0.0, x, kDt);
      const double t = n * kDt;
      const double r = 1.0 / std::sqrt(1.0 + (1.0 / (r0 * r0) - 1.0) * std::exp(-2.0 * t));
      ASSERT_NEAR(x.norm(), r, 1e-8) << t;
      ASSERT_NEAR(math::wrap_pi(phase_of(x) - 0.25 * math::kTwoPi - 7.0 * t), 0.0, 1e-8) << t;
    }
  }
}

TEST(AndronovHopf, SymmetrizedJacobianHasTheEigenvaluesOfTheContractionBound) {
  // 1 − r² along the circle, 1 − 3r² across: at most 1, hence kλ⁺ > 1 [M18 4.3.1]
  constexpr double kStep = 1e-6;
  for (const double r : {0.0, 0.4, 1.0, 1.7}) {
    const Vector2d x = r * Vector2d(std::cos(0.7), std::sin(0.7));
    const AndronovHopf oscillator{5.0};
    Eigen::Matrix2d jacobian;
    for (int k = 0; k < 2; ++k) {
      const Vector2d d = kStep * Vector2d::Unit(k);
      jacobian.col(k) = (oscillator.rate(x + d) - oscillator.rate(x - d)) / (2.0 * kStep);
    }
    const Eigen::Matrix2d symmetric = 0.5 * (jacobian + jacobian.transpose());
    EXPECT_NEAR(symmetric.trace(), 2.0 - 4.0 * r * r, 1e-7);
    EXPECT_NEAR(symmetric.determinant(), (1.0 - r * r) * (1.0 - 3.0 * r * r), 1e-7);
  }
}

TEST(AndronovHopf, PhaseIsInOneTurn) {
  EXPECT_EQ(phase_of({1.0, 0.0}), 0.0);
  EXPECT_NEAR(phase_of({0.0, -2.0}), 0.75 * math::kTwoPi, 1e-15);
}

TEST(AndronovHopf, PullsTowardsTheOther) {
  EXPECT_EQ(AndronovHopf::pull({1.0, 2.0}, {4.0, 1.0}), Vector2d(3.0, -1.0));
}

}  // namespace
}  // namespace mimesis::dmp
