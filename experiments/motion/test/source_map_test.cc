#include "experiments/motion/source_map.h"

#include <gtest/gtest.h>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/testing/no_malloc.h"
#include "experiments/motion/svr_character.h"
#include "nodes/synthesizer/dynamics/character_batch.h"
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
  EXPECT_EQ(tabulate(maps, 0, 100), tabulate(learn_source_maps(model), 0, 100));
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

/// Largest difference of the fast path to the plain one over a cycle [rad].
double worst_difference(motion::MotionModel model) {
  SvrCharacter plain(model, 5.0, 0.005);
  model.sources = tabulate(plain.maps(), model.fixed, 200);
  CharacterBatch fast(model, 1, {.dt_s = 0.005});
  double worst = 0.0;
  for (int n = 0; n < 400; ++n) {
    plain.step();
    fast.step();
    for (int r = 0; r < fast.rows(); ++r) {
      const double a = static_cast<double>(fast.angles(0)[std::size_t(r)]);
      worst = std::max(worst, std::abs(a - plain.angles()[r]));
    }
  }
  return worst;
}

TEST(SvrCharacter, TheFastPathAgreesWithinAThousandthOfARadian) {
  for (const int fixed : {0, 1}) {
    const double worst = worst_difference(testing::random_model(8, 4, 1, fixed));
    RecordProperty("worst_rad", std::to_string(worst));
    EXPECT_LT(worst, 1e-3) << fixed;
  }
}

TEST(SvrCharacter, LeavesThatLagChangeTheMotionUntilTheyHaveFollowed) {
  const motion::MotionModel model = testing::random_model(8);
  SvrCharacter lagging(model, 5.0, 0.005), straight(model, 5.0, 0.005);
  lagging.network().set_phase(2, 1.0);
  lagging.step();
  straight.step();
  EXPECT_GT((lagging.angles() - straight.angles()).norm(), 0.1);
  for (int n = 0; n < 600; ++n) {
    lagging.step();
    straight.step();
  }
  EXPECT_LT((lagging.angles() - straight.angles()).norm(), 1e-6);
}

TEST(SvrCharacter, StepsWithoutAllocation) {
  SvrCharacter character(testing::random_model(8, 4, 1, 1), 5.0, 0.005);
  const mimesis::testing::NoMalloc guard;
  for (int n = 0; n < 3; ++n) character.step();
}

}  // namespace
}  // namespace mimesis::synthesizer
