#include "experiments/motion/source_map.h"

#include <gtest/gtest.h>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/synthesizer/dynamics/testing/synthetic_model.h"

namespace mimesis::synthesizer {
namespace {

Eigen::Vector2d source_map_at(double phase) { return {std::cos(phase), std::sin(phase)}; }

TEST(SourceMap, LearnsASourceOverTheCircle) {
  const motion::MotionModel model = testing::random_model(4);
  ::testing::internal::CaptureStdout();
  const std::vector<SourceMap> maps = learn_source_maps(model);
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  for (int k = 0; k < 4; ++k) {
    for (int t = 0; t < 100; ++t) {
      EXPECT_NEAR(maps[std::size_t(k)](source_map_at(math::kTwoPi * t / 100.0)),
                  model.sources(k, t), 3e-4);
    }
  }
}

TEST(SourceMap, DelaysAreRotations) {  // s(t − τ), not s(t + τ)
  const motion::MotionModel model = testing::random_model(4);
  const std::vector<SourceMap> maps = learn_source_maps(model);
  const double phi = math::kTwoPi * 13.0 / 100.0;
  for (int t = 13; t < 100; ++t) {
    EXPECT_NEAR(
        maps[0](delayed(source_map_at(math::kTwoPi * t / 100.0), std::cos(phi), std::sin(phi))),
        model.sources(0, t - 13), 3e-4);
  }
}

TEST(SourceMap, BadDataIsRefused) {
  EXPECT_THROW(SourceMap(Eigen::Matrix2Xd(2, 0), Eigen::VectorXd(0)), ConfigError);
  EXPECT_THROW(SourceMap(Eigen::Matrix2Xd::Zero(2, 3), Eigen::VectorXd::Zero(2)), ConfigError);
  EXPECT_THROW(SourceMap(Eigen::Matrix2Xd::Zero(2, 1), Eigen::VectorXd::Constant(1, NAN)),
               ConfigError);
  EXPECT_THROW(SourceMap(Eigen::Matrix2Xd::Zero(2, 1), Eigen::VectorXd::Zero(1), {.gamma = -1.0}),
               ConfigError);
}

}  // namespace
}  // namespace mimesis::synthesizer
