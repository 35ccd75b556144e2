#include "nodes/cognition/neural_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "common/testing/no_malloc.h"
#include "common/testing/refusal.h"
#include "nodes/cognition/exponential.h"

namespace mimesis::cognition {
namespace {

constexpr double kDt_s = 0.001;

template <class Real>
double peak(const NeuralField<Real>& field) {
  return static_cast<double>(std::ranges::max(field.activity()));
}

/// Adds a Gaussian input in the middle of the field, σ = 5.
template <class Real>
void drive(NeuralField<Real>& field, double amplitude) {
  const double dx = field.params().dx, middle = 0.5 * field.params().neurons * dx;
  for (std::size_t i = 0; i < field.input().size(); ++i) {
    const double d = (static_cast<double>(i) * dx - middle) / 5.0;
    field.input()[i] += static_cast<Real>(amplitude * std::exp(-0.5 * d * d));
  }
}

/// max u after `pulse_s` of input and relaxation until `end_s`.
template <class Real = double>
double peak_after(double amplitude, double pulse_s, double end_s, const FieldParams& params = {}) {
  NeuralField<Real> field(params, kDt_s);
  for (int i = 0; i < std::lround(end_s / kDt_s); ++i) {
    if (i < std::lround(pulse_s / kDt_s)) drive(field, amplitude);
    field.step();
  }
  return peak(field);
}

/// Time at which max u crosses 0 under constant `preshape` and an input `amplitude` from t = 0 [s].
double crossing_s(double preshape, double amplitude) {
  NeuralField<double> field({}, kDt_s);
  for (int i = -1500; i < 1000; ++i) {
    drive(field, preshape + (i >= 0 ? amplitude : 0.0));
    field.step();
    if (peak(field) > 0.0) return (i + 1) * kDt_s;
  }
  return NAN;
}

TEST(Exponential, IsAccurateAndSaturates) {
  for (double x = -80.0; x <= 80.0; x += 0.0137) {
    const auto f = static_cast<float>(x);
    const double exact = std::exp(static_cast<double>(f));
    EXPECT_NEAR(static_cast<double>(exponential(f)) / exact, 1.0, 2.5e-7) << x;
    EXPECT_NEAR(exponential(x) / std::exp(x), 1.0, 1e-15) << x;
  }
  EXPECT_EQ(exponential(1e30F), exponential(80.0F));
  EXPECT_EQ(exponential(-1e300), exponential(-600.0));
}

// One step against eq. 2.1 written down literally, with every distance of the open axis.
TEST(NeuralField, StepIsEquation21) {
  FieldParams p;
  p.neurons = 50;  // no whole number of blocks
  p.dx = 0.7;
  NeuralField<double> field(p, kDt_s);
  for (int i = 0; i < 60; ++i) {
    drive(field, 6.0);
    field.step();
  }
  ASSERT_GT(peak(field), 2.0);
  const std::vector<double> u(field.activity().begin(), field.activity().end());
  const auto sigmoid = [&](double v, double theta) {
    return 1.0 / (1.0 + std::exp(-2.0 * (v - theta)));
  };
  drive(field, 1.5);
  const std::vector<double> s(field.input().begin(), field.input().end());
  field.step();
  for (std::size_t x = 0; x < u.size(); ++x) {
    double excitation = 0.0, total = 0.0;
    for (std::size_t y = 0; y < u.size(); ++y) {
      const double d = (static_cast<double>(x) - static_cast<double>(y)) * p.dx;
      const double f2 = sigmoid(u[y], p.threshold2);
      if (std::abs(d) <= 20.3) excitation += 2.4 * std::exp(-d * d / 50.0) * f2 * p.dx;
      total += f2 * p.dx;
    }
    const double rate = -u[x] - 3.0 + s[x] + sigmoid(u[x], 0.1) * (excitation - 1.0 * total);
    EXPECT_NEAR(field.activity()[x], u[x] + kDt_s / 0.020 * rate, 1e-12) << x;
  }
  EXPECT_EQ(std::ranges::count(field.input(), 0.0), 50);  // used up
}

TEST(NeuralField, RestsWithoutInput) { EXPECT_NEAR(peak_after(0.0, 0.0, 2.0), -3.0, 0.01); }

TEST(NeuralField, HoldsWhatATransientInputIgnited) {
  NeuralField<double> field({}, kDt_s);
  for (int i = 0; i < 2000; ++i) {
    if (i < 200) drive(field, 6.0);
    field.step();
  }
  EXPECT_NEAR(peak(field), 6.76, 0.02);
  EXPECT_LT(field.speed_1_s(), 1.0);
  EXPECT_EQ(std::ranges::count_if(field.activity(), [](double u) { return u > 0; }), 9);
}

TEST(NeuralField, IgnitesAboveAThresholdOnly) {
  double lo = 0.0, hi = 6.0;
  while (hi - lo > 1e-3) {
    const double middle = 0.5 * (lo + hi);
    (peak_after(middle, 0.2, 2.0) > 0.0 ? hi : lo) = middle;
  }
  EXPECT_NEAR(hi, 2.26, 0.03);
  EXPECT_LT(peak_after(0.95 * hi, 0.2, 0.7), -2.9);  // 500 ms after the pulse
  EXPECT_GT(peak_after(1.05 * hi, 0.2, 2.0),
            5.0);  // 8 neurons wide instead of 9: the grid pins the edges
}

TEST(NeuralField, PreshapeSpeedsTheDecisionUp) {
  constexpr double kThreshold = 2.18;  // level of constant input
  EXPECT_TRUE(std::isnan(crossing_s(0.5 * kThreshold, 0.0)));
  const double alone = crossing_s(0.0, 1.25 * kThreshold);
  const double preshaped = crossing_s(0.5 * kThreshold, 1.25 * kThreshold);
  EXPECT_NEAR(alone, 0.054, 0.003);
  EXPECT_NEAR(preshaped, 0.019, 0.003);
  EXPECT_GE(alone / preshaped, 2.5);
}

TEST(NeuralField, StrongerInputWinsTheCompetition) {
  NeuralField<double> field({}, kDt_s);
  const auto bump = [&](int at, double amplitude) {
    for (int i = 0; i < 128; ++i) {
      field.input()[static_cast<std::size_t>(i)] +=
          amplitude * std::exp(-0.5 * std::pow((i - at) / 5.0, 2));
    }
  };
  for (int i = 0; i < 1000; ++i) {
    bump(32, 3.0);
    bump(96, 3.3);
    field.step();
  }
  EXPECT_GT(field.activity()[96], 5.0);
  EXPECT_LT(field.activity()[32], 0.0);
}

TEST(NeuralField, DoesNotDependOnTheGrid) {  // explicit dx: half the distance, twice the neurons
  FieldParams fine;
  fine.neurons = 256;
  fine.dx = 0.5;
  EXPECT_NEAR(peak_after(6.0, 0.2, 2.0, fine), peak_after(6.0, 0.2, 2.0),
              0.3);  // edges pinned finer
  EXPECT_NEAR(peak_after<float>(6.0, 0.2, 2.0), peak_after<double>(6.0, 0.2, 2.0), 1e-4);
}

TEST(NeuralField, RepeatsEveryBitWithoutAllocating) {
  NeuralField<float> a({}, kDt_s), b({}, kDt_s);
  for (int i = 0; i < 500; ++i) {
    if (i < 200) drive(a, 3.0);
    if (i < 200) drive(b, 3.0);
    const testing::NoMalloc guard;
    a.step();
    b.step();
  }
  EXPECT_EQ(std::memcmp(a.activity().data(), b.activity().data(), a.activity().size_bytes()), 0);
  a.reset();
  EXPECT_EQ(peak(a), -3.0);
}

TEST(NeuralField, RefusesImpossibleConstants) {
  const auto refused = [](FieldParams p, double dt_s, const char* what) {
    const std::string words = testing::refusal([&] { const NeuralField<double> field(p, dt_s); });
    EXPECT_NE(words.find(what), std::string::npos) << words;
  };
  refused({.threshold1 = 0.0, .threshold2 = 0.0}, kDt_s, "threshold1");
  refused({.resting_level = 1.0}, kDt_s, "resting_level");
  refused({.dx = 0.0}, kDt_s, "dx");
  refused({.tau_s = 0.02}, 0.03, "tau_s");
  refused({}, -0.001, "step");
}

}  // namespace
}  // namespace mimesis::cognition
