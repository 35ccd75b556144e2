#include "nodes/cognition/transient_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "common/error.h"
#include "common/testing/no_malloc.h"

namespace mimesis::cognition {
namespace {

constexpr double kStep_s = 0.002;

double sigmoid(double u, double slope, double threshold) {
  return 1.0 / (1.0 + std::exp(-slope * (u - threshold)));
}

void drive(TransientField& f) {
  for (std::size_t i = 0; i < f.input().size(); ++i) {
    f.input()[i] += 4.0 * std::exp(-0.5 * std::pow((static_cast<double>(i) - 20.0) / 4.0, 2));
  }
}

// One step against eq. 2.6 and 2.7 written down literally; v is rebuilt from the start.
TEST(TransientField, StepIsEquations26And27) {
  TransientParams p;
  p.neurons = 45;
  p.dx = 0.8;
  TransientField field(p, kStep_s);
  const std::size_t n = 45;
  std::vector<double> u(n, p.resting_level), v(n, 0.0);
  for (int k = 0; k < 120; ++k) {
    std::vector<double> s(n, 0.0), du(n), dv(n);
    if (k < 30) {
      drive(field);
      s.assign(field.input().begin(), field.input().end());
    }
    for (std::size_t i = 0; i < n; ++i) {
      double excitation = 0.0, inhibition = 0.0;
      for (std::size_t j = 0; j < n; ++j) {
        const double d = (static_cast<double>(i) - static_cast<double>(j)) * 0.8;
        const double f = sigmoid(u[j], 2.0, 0.0);
        if (std::abs(d) <= 12.01) excitation += 1.3 * std::exp(-d * d / 18.0) * f * 0.8;
        if (std::abs(d) <= 32.01) inhibition += 0.6 * std::exp(-d * d / 128.0) * f * 0.8;
      }
      du[i] = -u[i] - 2.0 + s[i] + sigmoid(u[i], 2.0, 0.0) * (excitation - v[i]);
      dv[i] = -v[i] + sigmoid(v[i], 1.0, 1.0) * inhibition;
    }
    for (std::size_t i = 0; i < n; ++i) {
      u[i] += kStep_s / 0.020 * du[i];
      v[i] += kStep_s / 0.150 * dv[i];
    }
    const testing::NoMalloc guard;
    field.step();
  }
  for (std::size_t i = 0; i < n; ++i) EXPECT_NEAR(field.activity()[i], u[i], 1e-9) << i;
  EXPECT_GT(field.activity()[20], 1.0);
}

TEST(TransientField, RefusesImpossibleConstants) {
  EXPECT_THROW(TransientField({.tau_v_s = 0.01}, kStep_s), ConfigError);
  EXPECT_THROW(TransientField({.width_v = 2.0}, kStep_s), ConfigError);
  EXPECT_THROW(TransientField({.resting_level = 1.0}, kStep_s), ConfigError);
  EXPECT_THROW(ShuntedLink({.beta = 2.0}, kStep_s, 1, 1, 0.0), ConfigError);
}

// With constant activity eq. 2.8 is linear: s(t) goes to s∞ = h α f f / (h + β) at (h + β) / τ_s.
TEST(ShuntedLink, FollowsTheClosedForm) {
  const ShuntedParams p;
  for (const auto& [u, rate, source] :
       {std::tuple{8.0, 0.9, 1.0}, {8.0, 0.9, 0.0}, {6.8, 0.5, 0.7}, {2.0, 0.4, 1.0}}) {
    const double h = sigmoid(u, p.slope, p.threshold);
    const double end = h * p.alpha * rate * source / (h + p.beta);
    const double exact = end + (0.3 - end) * std::exp(-0.1 * (h + p.beta) / p.tau_s);
    ShuntedLink link(p, 1e-5, 1, 1, 0.3);
    const std::vector<double> us{u}, rates{rate}, sources{source};
    for (int k = 0; k < 10000; ++k) link.learn(us, rates, sources);
    EXPECT_NEAR(link.weight(0, 0), exact, 2e-5) << u << ' ' << source;
  }
}

TEST(ShuntedLink, TransmitsTheWeightedRates) {
  ShuntedLink link({}, kStep_s, 2, 2, 0.0);
  link.weight(0, 1) = 0.5;
  link.weight(1, 0) = 0.25;
  std::vector<double> input{1.0, 1.0};
  link.transmit(std::vector{0.8, 0.6}, 2.0, input);
  EXPECT_DOUBLE_EQ(input[0], 1.0 + 2.0 * 0.5 * 0.6);
  EXPECT_DOUBLE_EQ(input[1], 1.0 + 2.0 * 0.25 * 0.8);
}

}  // namespace
}  // namespace mimesis::cognition
