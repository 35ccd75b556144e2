#include "nodes/crowd/rules/gait.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "common/error.h"
#include "common/math/circle.h"

namespace mimesis::crowd {
namespace {

constexpr double kCosine[] = {0.01, -0.03, 0.004};
constexpr double kSine[] = {0.02, 0.05, 0.0, -0.006};

SpeedFunction walking() { return {0.2, kCosine, kSine}; }

TEST(SpeedFunction, IsItsSeries) {
  const SpeedFunction g = walking();
  for (double phi = -7.0; phi < 7.0; phi += 0.37) {
    const double expected = 0.2 + 0.01 * std::cos(phi) - 0.03 * std::cos(2 * phi) +
                            0.004 * std::cos(3 * phi) + 0.02 * std::sin(phi) +
                            0.05 * std::sin(2 * phi) - 0.006 * std::sin(4 * phi);
    EXPECT_NEAR(g(phi), expected, 1e-15);
    EXPECT_NEAR(g(phi), g(phi + math::kTwoPi), 1e-14);
  }
}

TEST(SpeedFunction, IntegralIsThatOfTheSeriesFromZero) {
  const SpeedFunction g = walking();
  EXPECT_EQ(g.integral(0.0), 0.0);
  constexpr double kStep = 1e-4;
  for (double phi = -9.0; phi < 9.0; phi += 0.71) {
    EXPECT_NEAR((g.integral(phi + kStep) - g.integral(phi - kStep)) / (2 * kStep), g(phi), 1e-8);
  }
  EXPECT_NEAR(g.integral(3 * math::kTwoPi), 3 * g.cycle_m(), 1e-14);
  EXPECT_NEAR(g.cycle_m(), math::kTwoPi * 0.2, 1e-15);
  EXPECT_EQ(g.mean(), 0.2);
}

TEST(SpeedFunction, ExtremesAreThoseOfTheSeries) {
  const double two[] = {0.0, 0.05};
  const SpeedFunction plain(0.2, {}, two);
  EXPECT_NEAR(plain.least(), 0.15, 1e-12);
  EXPECT_NEAR(plain.most(), 0.25, 1e-12);
  const SpeedFunction g = walking();
  double least = 1.0, most = 0.0;
  for (int i = 0; i < 100'000; ++i) {
    const double value = g(math::kTwoPi * i / 1e5);
    least = std::min(least, value);
    most = std::max(most, value);
  }
  EXPECT_LE(g.least(), least);
  EXPECT_NEAR(g.least(), least, 1e-9);
  EXPECT_GE(g.most(), most);
  EXPECT_NEAR(g.most(), most, 1e-9);
  EXPECT_GT(g.least(), 0.0);
  const SpeedFunction even(0.2, {}, {});
  EXPECT_EQ(even.least(), even.most());
}

TEST(SpeedFunction, RefusesWhereContractionWouldEnd) {
  const double touching[] = {0.2}, beyond[] = {0.3}, nearly[] = {0.199};
  EXPECT_THROW(SpeedFunction(0.2, touching, {}), ConfigError);
  EXPECT_THROW(SpeedFunction(0.2, beyond, {}), ConfigError);
  EXPECT_NO_THROW(SpeedFunction(0.2, nearly, {}));
  EXPECT_THROW(SpeedFunction(0.0, {}, {}), ConfigError);
  EXPECT_THROW(SpeedFunction(-0.2, {}, {}), ConfigError);
  EXPECT_THROW(SpeedFunction(std::numeric_limits<double>::quiet_NaN(), {}, {}), ConfigError);
  EXPECT_THROW(SpeedFunction(std::numeric_limits<double>::infinity(), {}, {}), ConfigError);
  const double five[5] = {};
  EXPECT_THROW(SpeedFunction(0.2, five, {}), ConfigError);
  EXPECT_THROW(SpeedFunction(0.2, {}, five), ConfigError);
  try {
    (void)SpeedFunction(0.2, beyond, {});
  } catch (const ConfigError& e) {
    EXPECT_NE(std::string(e.what()).find("contraction needs g > 0"), std::string::npos);
  }
}

TEST(SpeedFunction, TouchingBetweenSamplesIsRefusedToo) {
  // cos 1-harmonic whose least phase lies between two samples: 0.2 cos(phi - half a sample)
  const double off = math::kTwoPi / 1440.0;
  const double c[] = {0.2 * std::cos(off)}, s[] = {0.2 * std::sin(off)};
  EXPECT_THROW(SpeedFunction(0.2, c, s), ConfigError);
}

TEST(HeadingSway, IsTheSeriesWithoutMean) {
  const HeadingSway sway =
      HeadingSway::make(std::vector<double>{0.1, 0.0, 0.02}, std::vector<double>{0.0, -0.05});
  EXPECT_NEAR(sway(0.0), 0.12, 1e-15);
  EXPECT_NEAR(sway(0.7), 0.1 * std::cos(0.7) + 0.02 * std::cos(2.1) - 0.05 * std::sin(1.4), 1e-15);
  EXPECT_FALSE(sway.none());
  EXPECT_TRUE(HeadingSway{}.none());
}

TEST(HeadingSway, RefusesWhatIsNone) {
  EXPECT_THROW((void)HeadingSway::make(std::vector<double>(5, 0.0), {}), ConfigError);
  EXPECT_THROW((void)HeadingSway::make({}, std::vector<double>(5, 0.0)), ConfigError);
  EXPECT_THROW((void)HeadingSway::make({}, std::vector<double>{NAN}), ConfigError);
}

}  // namespace
}  // namespace mimesis::crowd
