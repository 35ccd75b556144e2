#include "experiments/motion/styles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/motion/demix/mixture.h"
#include "common/testing/no_malloc.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kStylesPi = std::numbers::pi;

Eigen::RowVectorXd styles_wave(const std::vector<std::pair<int, double>>& harmonics,
                               int length = 100) {
  Eigen::RowVectorXd s(length);
  for (int t = 0; t < length; ++t) {
    s[t] = 0.0;
    for (const auto& [f, a] : harmonics) {
      s[t] += a * std::cos(math::kTwoPi * f * t / length + 0.4 * f);
    }
  }
  return s / std::sqrt(s.squaredNorm() / length);
}

Eigen::MatrixXd motion(const Eigen::MatrixXd& sources, const MotionParameters& p) {
  return demix::Mixture{sources, p.weight_rad, p.delay_rad, p.mean_rad, 0}.reconstruct();
}

/// Sources with every kind of ambiguity: any turn; a half turn with the sign; a third; a quarter
/// turn with the sign.
Eigen::MatrixXd ambiguous_sources() {
  Eigen::MatrixXd s(4, 100);
  s.row(0) = styles_wave({{1, 1.0}, {2, 0.4}});
  s.row(1) = styles_wave({{1, 1.0}, {3, 0.3}});
  s.row(2) = styles_wave({{3, 1.0}, {6, 0.5}});
  s.row(3) = styles_wave({{2, 1.0}, {6, 0.2}});
  return s;
}

MotionParameters some_motion() {
  MotionParameters p{Eigen::VectorXd::LinSpaced(5, -0.3, 0.4), Eigen::MatrixXd(5, 4),
                     Eigen::MatrixXd(5, 4), 6.0};
  for (int r = 0; r < 5; ++r) {
    for (int k = 0; k < 4; ++k) {
      p.weight_rad(r, k) = 0.3 * std::sin(1.0 + 2.3 * r + 1.1 * k);
      p.delay_rad(r, k) = 3.0 * std::sin(0.3 + 1.7 * r + 2.9 * k);
    }
  }
  return p;
}

/// An equal motion with other parameters.
MotionParameters disguised(MotionParameters p, int variant) {
  for (int r = 0; r < 5; ++r) {
    const int q = r + variant;
    p.delay_rad(r, 0) += math::kTwoPi * (q % 3 - 1);
    p.delay_rad(r, 1) += kStylesPi * q;
    if (q % 2) p.weight_rad(r, 1) *= -1.0;
    p.delay_rad(r, 2) += math::kTwoPi / 3.0 * q;
    p.delay_rad(r, 3) += kStylesPi / 2.0 * q;
    if (q % 2) p.weight_rad(r, 3) *= -1.0;
  }
  return p;
}

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
  EXPECT_NEAR(styles.parameters[1].frequency_rad_s, kStylesPi, 1e-12);
  EXPECT_EQ(styles.index("sad"), 1u);
  try {
    (void)styles.index("angry");
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_STREQ(e.what(), "style 'angry' is unknown, expected one of happy, sad");
  }
  model.patterns[1].trial.duration_s = 0.0;
  EXPECT_THROW(styles_of(model), ConfigError);
  model.patterns[1].trial.duration_s = 1.0;
  model.patterns[1].weight_rad(0, 0) = std::nan("");
  EXPECT_THROW(styles_of(model), ConfigError);
}

}  // namespace
}  // namespace mimesis::synthesizer
