#include <gtest/gtest.h>

#include "common/error.h"
#include "common/motion/demix/test/known_mixture.h"
#include "common/motion/model/motion_model.h"

namespace mimesis::motion {
namespace {

TEST(MakeModel, HasAPatternForEveryTrial) {
  const demix::Known known = demix::known_mixture({.trials = 3, .rows = 4, .tied = true});
  const MotionModel m = make_model(known.set, known.mixture, true, mocap::standard_body());
  ASSERT_EQ(m.patterns.size(), 3U);
  EXPECT_NEAR(m.quality, 1.0, 1e-9);
  EXPECT_EQ(m.patterns[2].weight_rad, known.mixture.weights.bottomRows(4));
  EXPECT_EQ(m.patterns[1].delay_rad, m.patterns[0].delay_rad);
  EXPECT_EQ(m.patterns[1].mean_rad, known.mixture.means.segment(4, 4));
  demix::Mixture other = known.mixture;
  other.weights = other.weights.topRows(8).eval();
  EXPECT_THROW(make_model(known.set, other, true, mocap::standard_body()), ConfigError);
}

TEST(MakeModel, StylesAreAveraged) {
  demix::Known known = demix::known_mixture({.trials = 3, .rows = 4, .tied = true});
  const char* styles[] = {"slow", "fast", "slow"};
  for (std::size_t i = 0; i < 3; ++i) {
    known.set.trials[i].style = styles[i];
    known.set.trials[i].duration_s = 1.0 + double(i);
  }
  const MotionModel all = make_model(known.set, known.mixture, true, mocap::standard_body());
  const MotionModel mean = average_styles(all);
  ASSERT_EQ(mean.patterns.size(), 2U);
  EXPECT_EQ(mean.patterns[0].trial.style, "slow");
  EXPECT_DOUBLE_EQ(mean.patterns[0].trial.duration_s, 2.0);
  EXPECT_LT((mean.patterns[0].weight_rad -
             0.5 * (all.patterns[0].weight_rad + all.patterns[2].weight_rad))
                .norm(),
            1e-14);
  EXPECT_EQ(mean.patterns[1].mean_rad, all.patterns[1].mean_rad);
  MotionModel free = all;
  free.tied = false;
  EXPECT_THROW(average_styles(free), ConfigError);
}

}  // namespace
}  // namespace mimesis::motion
