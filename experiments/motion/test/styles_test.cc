#include "experiments/motion/styles.h"

#include <gtest/gtest.h>

#include <numbers>
#include <utility>

#include "common/error.h"
#include "common/motion/demix/mixture.h"
#include "common/testing/refusal.h"
#include "nodes/synthesizer/character/test/ambiguous_motion.h"

namespace mimesis::synthesizer {
namespace {

TEST(Styles, AverageThePatternsOfANameAfterTheAmbiguitiesAreGone) {
  motion::MotionModel model;
  model.sources = ambiguous_sources();
  const MotionParameters happy = some_motion();
  MotionParameters sad = happy;
  sad.mean_rad.array() -= 0.2;
  int variant = 0;
  for (const MotionParameters* m : {&happy, &happy, &std::as_const(sad)}) {
    const MotionParameters d = disguised(*m, variant++);
    mocap::Trial trial;
    trial.style = m == &sad ? "sad" : "happy";
    trial.duration_s = m == &sad ? 2.0 : 1.0;
    model.patterns.push_back({trial, d.mean_rad, d.weight_rad, d.delay_rad});
  }
  const Styles styles = styles_of(model);
  ASSERT_EQ(styles.names, (std::vector<std::string>{"happy", "sad"}));
  EXPECT_LT((motion(model.sources, styles.parameters[0]) - motion(model.sources, happy)).norm(),
            1e-7);
  EXPECT_NEAR(styles.parameters[1].frequency_rad_s, std::numbers::pi, 1e-12);
  EXPECT_EQ(styles.index("sad"), 1u);
  const std::string refused = mimesis::testing::refusal([&] { (void)styles.index("angry"); });
  EXPECT_EQ(refused, "style 'angry' is unknown, expected one of happy, sad");
  model.patterns[1].trial.duration_s = 0.0;
  EXPECT_THROW(styles_of(model), ConfigError);
  model.patterns[1].trial.duration_s = 1.0;
  model.patterns[1].weight_rad(0, 0) = std::nan("");
  EXPECT_THROW(styles_of(model), ConfigError);
}

TEST(Styles, BalancedMixtureIsEquation3_28) {
  const auto walk = [](double w) {
    return MotionParameters{Eigen::VectorXd::Constant(1, w), Eigen::MatrixXd::Constant(1, 1, w),
                            Eigen::MatrixXd::Zero(1, 1), 6.0};
  };
  const MotionParameters m = balanced_mixture(walk(1), walk(2), walk(4), 0.5);
  EXPECT_NEAR(m.weight_rad(0, 0), 0.75 + 0.125 * (1.5 * 2 + 0.5 * 4), 1e-15);
  EXPECT_NEAR(m.frequency_rad_s, 6.0, 1e-12);
}

}  // namespace
}  // namespace mimesis::synthesizer
