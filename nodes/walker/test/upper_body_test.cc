#include <gtest/gtest.h>

#include "common/model/files.h"
#include "common/testing/no_malloc.h"
#include "nodes/walker/walker.h"

namespace mimesis::walker {
namespace {

struct UpperBodyTest : ::testing::Test {
  Eigen::VectorXd half_sitting() const {
    Eigen::VectorXd q(Eigen::Index(biped.upper_body.size()));
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      q[i] = biped.half_sitting[biped.upper_body[std::size_t(i)]];
    }
    return q;
  }
  robot::Biped biped = model::load_biped(MIMESIS_SOURCE_DIR "/models/biped.yaml");
  UpperBodySettings settings;
  UpperBodyFollower body{biped, settings};
};

TEST_F(UpperBodyTest, SmoothWishIsFollowedWithoutLag) {
  const Eigen::VectorXd rest = half_sitting();
  const double rate = 3.0, amplitude = 0.2;
  double worst = 0.0;
  for (int k = 0; k < 1000; ++k) {
    const double t = k * kTick_s, grow = std::min(1.0, t);
    Eigen::VectorXd q = rest, dq = Eigen::VectorXd::Zero(rest.size());
    q[5] += grow * amplitude * std::sin(rate * t);
    dq[5] = grow * amplitude * rate * std::cos(rate * t);
    ASSERT_TRUE(body.wish(q, dq));
    body.step();
    if (t > 2.0) worst = std::max(worst, std::abs(body.now().q[5] - q[5]));
  }
  EXPECT_LT(worst, 0.005);
}

TEST_F(UpperBodyTest, JumpingWishKeepsLimitsOfSpeedAccelerationAndPosition) {
  Eigen::VectorXd far = half_sitting().array() + 10.0;
  ASSERT_TRUE(body.wish(far, {}));
  EXPECT_TRUE(body.clipped());
  Eigen::VectorXd before = body.now().dq;
  for (int k = 0; k < 2000; ++k) {
    body.step();
    EXPECT_LE((body.now().dq - before).cwiseAbs().maxCoeff(),
              kTick_s * settings.acceleration_rad_s2 + 1e-12);
    before = body.now().dq;
    for (Eigen::Index i = 0; i < far.size(); ++i) {
      const robot::Link& link = biped.tree.moved(biped.upper_body[std::size_t(i)]);
      ASSERT_LE(body.now().q[i], link.upper);
      ASSERT_LE(std::abs(body.now().dq[i]), link.max_speed);
    }
  }
  EXPECT_LT(body.now().dq.norm(), 1e-6);
  const robot::Link& first = biped.tree.moved(biped.upper_body[0]);
  EXPECT_NEAR(body.now().q[0], first.upper - settings.margin_rad, 1e-6);
}

TEST_F(UpperBodyTest, WishOfWrongSizeOrNotFiniteIsRefusedAndNoneMeansHalfSitting) {
  Eigen::VectorXd wish = half_sitting();
  wish[0] += 0.3;
  ASSERT_TRUE(body.wish(wish, {}));
  Eigen::VectorXd bad = wish;
  bad[1] = NAN;
  EXPECT_FALSE(body.wish(bad, {}));
  EXPECT_FALSE(body.wish(Eigen::VectorXd::Zero(2), {}));
  for (int k = 0; k < 1000; ++k) body.step();
  EXPECT_NEAR(body.now().q[0], wish[0], 1e-6) << "the last good one stays";
  ASSERT_TRUE(body.wish({}, {}));
  for (int k = 0; k < 1000; ++k) body.step();
  EXPECT_NEAR(body.now().q[0], half_sitting()[0], 1e-6);
}

TEST_F(UpperBodyTest, ForeseesThatItGoesOnAndComesToRest) {
  Eigen::VectorXd wish = half_sitting();
  wish[0] += 0.5;
  ASSERT_TRUE(body.wish(wish, {}));
  for (int k = 0; k < 10; ++k) body.step();
  const double v = body.now().dq[0];
  ASSERT_GT(v, 0.5);
  const auto ahead = body.ahead(20, 0.035, 0.3);
  ASSERT_EQ(ahead.size(), 20u);
  EXPECT_EQ(ahead[0].q, body.now().q);
  EXPECT_NEAR(ahead[1].q[0], body.now().q[0] + 0.3 * v * -std::expm1(-0.035 / 0.3), 1e-12);
  EXPECT_LT(ahead[19].dq[0], 0.2 * v);
  mimesis::testing::NoMalloc guard;
  body.wish(wish, {});
  body.step();
  body.ahead(20, 0.035, 0.3);
}

}  // namespace
}  // namespace mimesis::walker
