#include "nodes/crowd/gait/heading_sway.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/error.h"

namespace mimesis::crowd {
namespace {

TEST(HeadingSway, IsTheSeriesWithoutMean) {
  const HeadingSway sway =
      HeadingSway::make(std::vector<double>{0.1, 0.0, 0.02}, std::vector<double>{0.0, -0.05});
  EXPECT_NEAR(sway(0.0), 0.12, 1e-15);
  EXPECT_NEAR(sway(0.7), 0.1 * std::cos(0.7) + 0.02 * std::cos(2.1) - 0.05 * std::sin(1.4), 1e-15);
  EXPECT_FALSE(sway.none());
  EXPECT_TRUE(HeadingSway{}.none());
  // amplitude a/|m + ik|
  EXPECT_NEAR(sway.amplitude_rad(0.0), 0.1 + 0.05 / 2 + 0.02 / 3, 1e-15);
  EXPECT_NEAR(sway.amplitude_rad(2.0),
              0.1 / std::sqrt(5.0) + 0.05 / std::sqrt(8.0) + 0.02 / std::sqrt(13.0), 1e-15);
}

TEST(HeadingSway, RefusesWhatIsNone) {
  EXPECT_THROW((void)HeadingSway::make(std::vector<double>(5, 0.0), {}), ConfigError);
  EXPECT_THROW((void)HeadingSway::make({}, std::vector<double>(5, 0.0)), ConfigError);
  EXPECT_THROW((void)HeadingSway::make({}, std::vector<double>{NAN}), ConfigError);
}

}  // namespace
}  // namespace mimesis::crowd
