#include "nodes/synthesizer/character/delay_ambiguity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/math/circle.h"
#include "common/motion/demix/mixture.h"
#include "common/testing/no_malloc.h"
#include "nodes/synthesizer/character/test/ambiguous_motion.h"

namespace mimesis::synthesizer {
namespace {

TEST(SelfSimilarities, AreTheFractionsOfThePeriod) {
  const Eigen::MatrixXd s = ambiguous_sources();
  EXPECT_EQ(self_similarities(s.row(0), 0.95).size(), 1u);
  const auto half = self_similarities(s.row(1), 0.95);
  ASSERT_EQ(half.size(), 2u);
  EXPECT_NEAR(std::abs(half[1].shift_rad), std::numbers::pi, 1e-9);
  EXPECT_NEAR(half[1].similarity, -1.0, 1e-12);
  EXPECT_EQ(self_similarities(s.row(2), 0.95).size(), 3u);
  EXPECT_EQ(self_similarities(s.row(3), 0.95).size(), 4u);  // 0, ±π/2, π
  for (const auto& e : self_similarities(s.row(3), 0.95)) {
    EXPECT_NEAR(std::remainder(e.shift_rad, std::numbers::pi / 2.0), 0.0, 1e-9);
    EXPECT_NEAR(e.similarity, std::cos(2.0 * e.shift_rad), 1e-9);
  }
}

TEST(Disambiguation, TheSameMotionInDisguiseIsThatMotionAtEveryAlpha) {
  const Eigen::MatrixXd s = ambiguous_sources();
  const MotionParameters truth = some_motion();
  std::vector<MotionParameters> p = {truth, disguised(truth, 1), disguised(truth, 2)};
  const Eigen::MatrixXd x = motion(s, truth);
  for (const auto& one : p) ASSERT_LT((motion(s, one) - x).norm(), 1e-9);
  MotionParameters m;
  const auto worst = [&] {
    double error = 0.0;
    for (double a = 0.0; a <= 1.0; a += 0.1) {
      for (double b = 0.0; a + b <= 1.0; b += 0.1) {
        blend(p, std::vector{a, b, 1.0 - a - b}, m);
        error = std::max(error, (motion(s, m) - x).cwiseAbs().maxCoeff());
      }
    }
    return error;
  };
  EXPECT_GT(worst(), 0.2);  // why it is needed
  const Disambiguation done = remove_delay_ambiguities(s, 0, p);
  EXPECT_LT(worst(), 1e-8);
  EXPECT_GT(done.changed, 10);
  EXPECT_LT(done.worst_error_rad, 1e-8);
}

TEST(Disambiguation, SimilarMotionsInDisguiseAreBlendedAsIfNotDisguised) {
  const Eigen::MatrixXd s = ambiguous_sources();
  MotionParameters a = some_motion(), b = a;
  b.delay_rad.array() += 0.2;
  b.weight_rad *= 1.3;
  std::vector<MotionParameters> plain = {a, b}, hidden = {a, disguised(b, 1)};
  remove_delay_ambiguities(s, 0, hidden);
  MotionParameters m, n;
  for (const double alpha : {0.0, 0.3, 0.5, 0.9, 1.0}) {
    blend(plain, std::vector{alpha, 1.0 - alpha}, m);
    blend(hidden, std::vector{alpha, 1.0 - alpha}, n);
    EXPECT_LT((motion(s, m) - motion(s, n)).cwiseAbs().maxCoeff(), 1e-8) << alpha;
  }
}

TEST(Disambiguation, AnApproximateAmbiguityChangesTheMotionByWhatItSays) {
  Eigen::MatrixXd s(1, 100);
  s.row(0) = wave({{2, 1.0}, {3, 0.15}});
  const MotionParameters a{Eigen::VectorXd::Zero(1), Eigen::MatrixXd::Constant(1, 1, 0.5),
                           Eigen::MatrixXd::Constant(1, 1, 0.2), 6.0};
  MotionParameters b = a;
  b.delay_rad(0, 0) += std::numbers::pi;
  std::vector<MotionParameters> p = {a, b};
  const Disambiguation done = remove_delay_ambiguities(s, 0, p, 0.9);
  const Eigen::MatrixXd d = motion(s, p[0]) - motion(s, a), e = motion(s, p[1]) - motion(s, b);
  EXPECT_LT(std::abs(p[0].delay_rad(0, 0) - p[1].delay_rad(0, 0)), 0.05);
  EXPECT_NEAR(std::max(d.norm(), e.norm()) / 10.0, done.worst_error_rad, 1e-6);
  EXPECT_GT(done.worst_error_rad, 0.01);
  // too different to be called the same
  p = {a, b};
  EXPECT_EQ(remove_delay_ambiguities(s, 0, p, 0.999).changed, 0);
}

TEST(Disambiguation, TiedDelaysAndFixedSourcesStay) {
  const Eigen::MatrixXd s = ambiguous_sources();
  std::vector<MotionParameters> p = {some_motion(), some_motion()};
  p[1].weight_rad *= -0.7;
  const auto before = p;
  EXPECT_EQ(remove_delay_ambiguities(s, 0, p).changed, 0);
  EXPECT_EQ(p[1].weight_rad, before[1].weight_rad);
  EXPECT_EQ(p[1].delay_rad, before[1].delay_rad);
  p[1] = disguised(p[1], 1);
  EXPECT_EQ(remove_delay_ambiguities(s, 4, p).changed, 0);
}

TEST(Blend, GoesFromOneToTheOtherWithoutAllocation) {
  std::vector<MotionParameters> p = {some_motion(), some_motion()};
  p[1].mean_rad.array() += 1.0;
  p[1].weight_rad *= 2.0;
  p[1].delay_rad.array() += 0.5;
  p[1].frequency_rad_s = 8.0;
  MotionParameters m = p[0];
  const std::array alpha = {0.25, 0.75};
  {
    const mimesis::testing::NoMalloc guard;
    blend(p, alpha, m);
  }
  EXPECT_LT((m.mean_rad - p[0].mean_rad).array().abs().maxCoeff() - 0.75, 1e-12);
  EXPECT_LT((m.weight_rad - 1.75 * p[0].weight_rad).norm(), 1e-12);
  EXPECT_NEAR(m.delay_rad(2, 2), p[0].delay_rad(2, 2) + 0.375, 1e-12);
  EXPECT_NEAR(m.frequency_rad_s, 7.5, 1e-12);
}

}  // namespace
}  // namespace mimesis::synthesizer
