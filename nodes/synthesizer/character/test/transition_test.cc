#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "nodes/synthesizer/character/parameters.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kBeta = 0.2;

/// One row: mean, a ramp as fixed source, one periodic source.
MotionParameters one_row(double mean, double ramp, double wave, double frequency = 6.0) {
  return {Eigen::VectorXd::Constant(1, mean), Eigen::RowVector2d(ramp, wave),
          Eigen::RowVector2d(0.0, 0.4), frequency};
}

/// Joint angle at phase φ in [0, 2π) of an action.
double angle(const MotionParameters& p, double phase) {
  return p.mean_rad[0] + p.weight_rad(0, 0) * std::cos(0.5 * phase) +
         p.weight_rad(0, 1) * std::cos(phase - p.delay_rad(0, 1));
}

TEST(TransitionWeight, IsEquation3_23) {
  EXPECT_EQ(transition_weight(-kBeta * std::numbers::pi - 0.01, kBeta), 0.0);
  EXPECT_EQ(transition_weight(kBeta * std::numbers::pi + 0.01, kBeta), 1.0);
  EXPECT_NEAR(transition_weight(0.0, kBeta), 0.5, 1e-15);
  EXPECT_NEAR(transition_weight(0.1, kBeta), 0.5 * (1.0 + std::sin(0.25)), 1e-15);
  EXPECT_NEAR(transition_weight(kBeta * std::numbers::pi - 1e-9, kBeta), 1.0,
              1e-12);  // no jump at the ends
  EXPECT_NEAR(transition_weight(-kBeta * std::numbers::pi + 1e-9, kBeta), 0.0, 1e-12);
}

TEST(Transition, JointAngleAndItsTwoDerivativesAreContinuousAtTheBoundary) {
  // weights of the ramp of the same and of opposite signs
  for (const double ramp : {0.5, -0.5}) {
    const MotionParameters a = one_row(0.2, 0.4, 0.1), b = one_row(-0.1, ramp, 0.3);
    MotionParameters m;
    const auto at = [&](double phase) {
      transition(a, b, 1, phase, kBeta, m);
      return angle(m, phase < 0.0 ? phase + 2.0 * std::numbers::pi : phase);
    };
    const double h = 1e-3;
    const double before = at(-1e-9), after = at(0.0);
    EXPECT_NEAR(before, after, 1e-8);
    // W_trans of [M18], without the periodic source
    EXPECT_NEAR(after, (0.2 - 0.1) / 2.0 + (ramp - 0.4) / 2.0 + 0.2 * std::cos(0.4), 1e-12);
    EXPECT_NEAR((at(-1e-9) - at(-h)) / h, (at(h) - at(0.0)) / h, 5e-3);
    const auto curvature = [&](double x) { return (at(x + h) - 2 * at(x) + at(x - h)) / (h * h); };
    EXPECT_NEAR(curvature(-2 * h), curvature(2 * h), 5e-2);
    // the pure actions at the ends
    EXPECT_NEAR(at(-kBeta * std::numbers::pi),
                angle(a, 2.0 * std::numbers::pi - kBeta * std::numbers::pi), 1e-12);
    EXPECT_NEAR(at(kBeta * std::numbers::pi), angle(b, kBeta * std::numbers::pi), 1e-12);
  }
}

TEST(Transition, LinearBlendingOfTheRampWouldJump) {
  const MotionParameters a = one_row(0.0, 0.4, 0.0), b = one_row(0.0, 0.5, 0.0);
  MotionParameters m;
  transition(a, b, 0, -1e-9, kBeta, m);
  const double before = angle(m, 2.0 * std::numbers::pi - 1e-9);
  transition(a, b, 0, 0.0, kBeta, m);
  EXPECT_GT(std::abs(angle(m, 0.0) - before), 0.8);
}

}  // namespace
}  // namespace mimesis::synthesizer
