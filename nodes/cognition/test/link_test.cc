#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "common/testing/no_malloc.h"
#include "nodes/cognition/neural_field.h"

namespace mimesis::cognition {
namespace {

constexpr std::size_t kN = 64;
constexpr double kEta = 0.3, kLocal = 0.05;

/// Bell-shaped rates around `at`.
std::vector<double> pattern(double at) {
  std::vector<double> rate(kN);
  for (std::size_t i = 0; i < kN; ++i) {
    const double d = (static_cast<double>(i) - at) / 4.0;
    rate[i] = 0.01 + 0.98 * std::exp(-0.5 * d * d);
  }
  return rate;
}

/// Largest distance of `link` from eq. 2.4, relative to its maximum.
double error_of_24(const Link<double>& link, const std::vector<double>& target,
                   const std::vector<double>& source) {
  double worst = 0.0, largest = 0.0;
  for (std::size_t x = 0; x < kN; ++x) {
    for (std::size_t y = 0; y < kN; ++y) {
      const bool both = target[x] >= kLocal && source[y] >= kLocal;
      const double exact = both ? kEta * target[x] * source[y] : 0.0;
      worst = std::max(worst, std::abs(link.weight(x, y) - exact));
      largest = std::max(largest, exact);
    }
  }
  return worst / largest;
}

std::vector<double> bits(const Link<double>& link) {
  std::vector<double> all;
  for (std::size_t y = 0; y < kN; ++y) {
    for (std::size_t x = 0; x < kN; ++x) all.push_back(link.weight(x, y));
  }
  return all;
}

TEST(Link, LearningEndsInEquation24) {  // 2 s at τ_s = 400 ms leave exp(−5) = 0.7 %
  const auto target = pattern(20), source = pattern(40);
  Link<double> link(kN, kN, 1.0);
  for (int i = 0; i < 2000; ++i) {
    const testing::NoMalloc guard;
    link.learn(target, source, kEta, 0.001 / 0.4, {kLocal, kLocal});
  }
  EXPECT_LT(error_of_24(link, target, source), 0.01);
  EXPECT_GT(error_of_24(link, target, source), 0.005);  // learning took its time

  Link<double> closed(kN, kN, 1.0);
  closed.install(target, source, kEta, {kLocal, kLocal});
  EXPECT_LT(error_of_24(closed, target, source), 1e-15);
}

TEST(Link, WithoutRewardNoBitChanges) {
  const auto a = pattern(15), b = pattern(45), other = pattern(30);
  Link<double> link(kN, kN, 1.0);
  link.install(a, b, kEta, {kLocal, kLocal});
  const auto before = bits(link);
  for (int i = 0; i < 100; ++i) link.learn(other, b, kEta, 0.0, {kLocal, kLocal});
  EXPECT_EQ(std::memcmp(bits(link).data(), before.data(), before.size() * sizeof(double)), 0);
}

TEST(Link, LearningOnePatternLeavesTheOther) {
  const auto low = pattern(12), high = pattern(50);
  Link<double> link(kN, kN, 1.0);
  link.install(low, low, kEta, {kLocal, kLocal});
  const auto before = bits(link);
  for (int i = 0; i < 2000; ++i) link.learn(high, high, kEta, 0.0025, {kLocal, kLocal});
  for (std::size_t y = 0; y < kN / 2; ++y) {
    for (std::size_t x = 0; x < kN / 2; ++x) EXPECT_EQ(link.weight(x, y), before[y * kN + x]);
  }
  EXPECT_NEAR(link.weight(50, 50), kEta * 0.99 * 0.99, 0.01 * kEta);
}

TEST(Link, LearningOneTargetLeavesTheOther) {  // same source: a goal that two sequences reach
  const auto source = pattern(30), low = pattern(12), high = pattern(50);
  Link<double> link(kN, kN, 1.0);
  link.install(low, source, kEta, {kLocal, kLocal});
  const auto before = bits(link);
  for (int i = 0; i < 2000; ++i) link.learn(high, source, kEta, 0.0025, {kLocal, kLocal});
  for (std::size_t y = 0; y < kN; ++y) {
    for (std::size_t x = 0; x < kN / 2; ++x) EXPECT_EQ(link.weight(x, y), before[y * kN + x]);
  }
  EXPECT_NEAR(link.weight(50, 30), kEta * 0.99 * 0.99, 0.01 * kEta);
}

TEST(Link, LowRankIsTheSameLink) {
  const auto a = pattern(15), b = pattern(45), rate = pattern(30);
  Link<double> dense(kN, kN, 0.5), factors(kN, kN, 0.5, true);
  for (auto* link : {&dense, &factors}) {
    link->install(a, b, kEta, {kLocal, kLocal});
    link->install(b, a, 0.5 * kEta, {kLocal, kLocal});
  }
  std::vector<double> of_dense(kN), of_factors(kN);
  dense.transmit(rate, of_dense);
  factors.transmit(rate, of_factors);
  for (std::size_t x = 0; x < kN; ++x) {
    EXPECT_NEAR(of_factors[x], of_dense[x], 1e-13);
    EXPECT_NEAR(factors.input_at(rate, x), of_dense[x], 1e-13);
    for (std::size_t y = 0; y < kN; ++y) {
      EXPECT_NEAR(factors.weight(x, y), dense.weight(x, y), 1e-15);
    }
  }
  EXPECT_GT(of_dense[15], 0.01);
}

TEST(Link, TransmitsTheIntegral) {
  const auto target = pattern(20), source = pattern(40), rate = pattern(38);
  const double dy = 0.5;
  Link<double> link(kN, kN, dy);
  link.install(target, source, kEta, {kLocal, kLocal});
  std::vector<double> input(kN, 1.0);
  {
    const testing::NoMalloc guard;
    link.transmit(rate, input);
  }
  for (std::size_t x = 0; x < kN; ++x) {
    double s = 1.0;  // adds to the present input
    for (std::size_t y = 0; y < kN; ++y) s += link.weight(x, y) * rate[y] * dy;
    EXPECT_NEAR(input[x], s, 1e-12);
  }
  EXPECT_GT(input[20], 1.5);
  EXPECT_EQ(input[60], 1.0);
}

}  // namespace
}  // namespace mimesis::cognition
