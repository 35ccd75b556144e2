#include "nodes/walker/stabilizer/leg_give.h"

#include <gtest/gtest.h>

namespace mimesis::walker {
namespace {

constexpr double kWeight = 570.0, kLeast = 0.2 * kWeight;

TEST(LegGive, IsTheSlopeOfShorteningOverLoad) {
  LegGive give;
  for (int k = 0; k < 800; ++k) {  // the weight goes from one foot to the other
    const double left = 0.5 + 0.5 * std::sin(0.05 * k);
    give.measure(left * kWeight, 3e-6 * left * kWeight);
    give.measure((1.0 - left) * kWeight, 3e-6 * (1.0 - left) * kWeight);
  }
  EXPECT_NEAR(give.m_n(kLeast), 3e-6, 1e-12);
}

TEST(LegGive, LeastSquaresWeighsHeavyLoadsMore) {
  LegGive give;
  for (int k = 0; k < 20'000; ++k) {
    give.measure(400.0, 4e-6 * 400.0);
    give.measure(200.0, 1e-6 * 200.0);
  }
  EXPECT_NEAR(give.m_n(kLeast), (4e-6 * 16.0 + 1e-6 * 4.0) / 20.0, 2e-9);
}

TEST(LegGive, ForgetsAJointThatHasChangedInSeconds) {
  LegGive give;
  for (int k = 0; k < 2000; ++k) give.measure(kWeight, 2e-6 * kWeight);
  const int ticks = static_cast<int>(2.0 / kTick_s);
  for (int k = 0; k < ticks; ++k) give.measure(kWeight, 5e-6 * kWeight);
  EXPECT_NEAR(give.m_n(kLeast), 5e-6 - 3e-6 * std::exp(-1.0), 1e-8);
}

TEST(LegGive, IsNothingBeforeTheLegsBearOrIfTheyGetLonger) {
  LegGive give;
  EXPECT_EQ(give.m_n(kLeast), 0.0);
  for (int k = 0; k < 2000; ++k) give.measure(0.9 * kLeast, 1e-3);
  EXPECT_EQ(give.m_n(kLeast), 0.0);
  for (int k = 0; k < 2000; ++k) give.measure(kWeight, -1e-3);
  EXPECT_EQ(give.m_n(kLeast), 0.0);
  for (int k = 0; k < 4000; ++k) give.measure(kWeight, 0.1);
  EXPECT_EQ(give.m_n(kLeast), 1e-5) << "no leg is so soft: bounded";
  give.reset();
  EXPECT_EQ(give.m_n(kLeast), 0.0);
}

}  // namespace
}  // namespace mimesis::walker
