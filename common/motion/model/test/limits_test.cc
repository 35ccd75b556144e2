#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "common/motion/model/motion_model.h"

namespace mimesis::motion {
namespace {

/// Rows a, b, c; b within 0.1 to 0.7, c within -1 to 1.
MotionModel limited() {
  MotionModel m;
  m.rows = {"a", "b", "c"};
  m.limits_rad = {std::nullopt, RowLimits{0.1, 0.7}, RowLimits{-1.0, 1.0}};
  m.sources.resize(1, 100);
  for (int t = 0; t < 100; ++t) m.sources(0, t) = std::sqrt(2.0) * std::cos(0.02 * M_PI * t);
  for (const double size : {0.3, 0.5}) {
    Pattern p;
    p.mean_rad = Eigen::Vector3d(5.0, 0.4, 0.2);
    p.weight_rad = Eigen::Vector3d(9.0, 1.0, -1.0) * (size / std::sqrt(2.0));
    p.delay_rad = Eigen::Vector3d(0.0, 0.5 * M_PI, 0.0);
    m.patterns.push_back(p);
  }
  return m;
}

TEST(Limits, ValuesBeyondAreMovedToTheLimitAndCounted) {
  const MotionModel m = limited();
  std::array<double, 3> v = {9.0, 0.8, -1.5};
  EXPECT_EQ(clamp_to_limits(m, std::span<double>(v)), 2);
  EXPECT_EQ(v, (std::array<double, 3>{9.0, 0.7, -1.0}));
  EXPECT_EQ(clamp_to_limits(m, std::span<double>(v)), 0);
  v = {0.0, std::nan(""), 1.0};
  EXPECT_EQ(clamp_to_limits(m, std::span<double>(v)), 1);
  EXPECT_EQ(v[1], 0.1);
  std::array<float, 3> f = {0.0F, 0.05F, 2.0F};
  EXPECT_EQ(clamp_to_limits(m, std::span<float>(f)), 2);
  MotionModel narrow = m;
  narrow.limits_rad[1] = RowLimits{0.7, 0.8};
  for (const float wrong : {-9.0F, 9.0F}) {  // 0.7F is below 0.7, 0.8F above 0.8
    f[1] = wrong;
    clamp_to_limits(narrow, std::span<float>(f));
    EXPECT_GE(static_cast<double>(f[1]), 0.7);
    EXPECT_LE(static_cast<double>(f[1]), 0.8);
    EXPECT_NEAR(f[1], wrong < 0.0F ? 0.7F : 0.8F, 1e-6F);
  }
  MotionModel none = m;
  none.limits_rad.clear();
  v = {9.0, 9.0, 9.0};
  EXPECT_EQ(clamp_to_limits(none, std::span<double>(v)), 0);
  EXPECT_EQ(v[2], 9.0);
}

TEST(Limits, TheMixturesExcessIsWhatItsCrestsSay) {
  const auto excess = limit_excess(limited());
  ASSERT_EQ(excess.size(), 2U);
  EXPECT_EQ(excess[0].row, "b");
  EXPECT_NEAR(excess[0].beyond_rad, 0.2, 1e-12);  // 0.4 ± 0.5
  EXPECT_EQ(excess[0].pattern, 1U);
  EXPECT_EQ(excess[1].row, "c");
  EXPECT_NEAR(excess[1].beyond_rad, 0.2 + 0.5 - 1.0, 1e-12);  // within by 0.3
  EXPECT_NEAR(excess[1].phase_rad, std::numbers::pi, 1e-12);
  MotionModel tight = limited();
  tight.limits_rad[1] = RowLimits{-5.0, 0.7};  // one side alone: the crest, at its delay
  EXPECT_NEAR(limit_excess(tight)[0].phase_rad, 0.5 * std::numbers::pi, 1e-12);
}

}  // namespace
}  // namespace mimesis::motion
