#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "common/math/circle.h"
#include "nodes/synthesizer/character/characters.h"
#include "nodes/synthesizer/character/courses.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kStyleDt = 0.005;

/// A character of three styles whose phase advances by 2π a second.
class StyleRig {
 public:
  void run(double duration_s) {
    const std::vector<double> before(course.shares().begin(), course.shares().end());
    for (int k = 0; k < std::lround(duration_s / kStyleDt); ++k) {
      const std::vector<double> last(course.shares().begin(), course.shares().end());
      if (!standing) phase = math::wrap_two_pi(phase + 2.0 * std::numbers::pi * kStyleDt);
      course.advance(kStyleDt, phase, standing);
      const auto now = course.shares();
      EXPECT_NEAR(std::accumulate(now.begin(), now.end(), 0.0), 1.0, 1e-12);
      std::vector<double> rate(3);
      for (std::size_t s = 0; s < 3; ++s) rate[s] = (now[s] - last[s]) / kStyleDt;
      for (std::size_t s = 0; s < 3; ++s) {
        largest_rate = std::max(largest_rate, std::abs(rate[s]));
        largest_jump = std::max(largest_jump, std::abs(rate[s] - last_rate[s]));
      }
      last_rate = rate;
    }
  }
  double share(int s) const { return course.shares()[static_cast<std::size_t>(s)]; }

  StyleCourse course{3, 0, 0.2};
  double phase = 0.0, largest_rate = 0.0, largest_jump = 0.0;  // rate [1/s], its change in a step
  bool standing = false;
  std::vector<double> last_rate = std::vector<double>(3, 0.0);
};

constexpr std::array<double, 3> kSecond = {0.0, 1.0, 0.0}, kThird = {0.0, 0.0, 1.0};

TEST(StyleCourse, AnEventIsAroundTheNextPhaseZero) {  // [M18 eq. 3.23], β = 1/5
  StyleRig rig;
  rig.run(0.3);
  rig.course.wish(kSecond, 0.0);
  rig.run(0.595);  // phase 0.895: the transition begins at 0.9 of the cycle
  EXPECT_EQ(rig.share(0), 1.0);
  EXPECT_TRUE(rig.course.changing());
  rig.run(0.105);
  EXPECT_NEAR(rig.share(1), 0.5, 0.01);
  rig.run(0.05);  // φ = 0.1π: ½(1 + sin(φ/2β)) = ½(1 + sin(π/4))
  EXPECT_NEAR(rig.share(1), 0.8536, 0.01);
  rig.run(0.055);
  EXPECT_EQ(rig.share(1), 1.0);
  EXPECT_FALSE(rig.course.changing());
  EXPECT_EQ(rig.course.largest(), 1);
}

TEST(StyleCourse, AnEventThatComesInTheMidstOfItsWindowWaitsForTheNext) {
  StyleRig rig;
  rig.run(0.95);
  rig.course.wish(kSecond, 0.0);
  rig.run(0.5);
  EXPECT_EQ(rig.share(1), 0.0);
  rig.run(0.7);
  EXPECT_EQ(rig.share(1), 1.0);
}

TEST(StyleCourse, ADurationIsAMinimumJerkCourse) {
  StyleRig rig;
  rig.course.wish(kSecond, 2.0);
  rig.run(0.5);  // u = ¼: 10u³ − 15u⁴ + 6u⁵
  EXPECT_NEAR(rig.share(1), 0.103516, 1e-6);
  rig.run(0.5);
  EXPECT_NEAR(rig.share(1), 0.5, 1e-9);
  rig.run(1.0 + kStyleDt);
  EXPECT_NEAR(rig.share(1), 1.0, 1e-12);
  EXPECT_FALSE(rig.course.changing());
}

TEST(StyleCourse, WishesThatFollowEachOtherMakeNoJumps) {
  StyleRig rig;
  rig.course.wish(kSecond, 1.0);
  rig.run(0.45);
  rig.course.wish(kThird, 1.0);
  rig.run(0.3);
  rig.course.wish(kSecond, 0.0);  // an event takes over from a course
  rig.run(0.3);
  rig.course.wish(kThird, 0.7);  // a course that starts from an event
  rig.run(0.3);
  rig.course.wish(kSecond, 0.0);
  rig.run(0.65);
  rig.course.wish(kThird, 0.0);  // while that transition is under way
  rig.run(3.0);
  EXPECT_EQ(rig.share(2), 1.0);
  EXPECT_LT(rig.largest_rate, 8.5);  // an event alone: 1/(4β) of 2π/s = 7.9/s
  EXPECT_LT(rig.largest_jump, 1.0);  // in 5 ms; a cut changes the rate by 200/s
}

TEST(StyleCourse, WhoStandsChangesAtOnce) {
  StyleRig rig;
  rig.standing = true;
  rig.course.wish(kSecond, 0.0);
  rig.run(StyleCourse::kStandingChange_s + kStyleDt);
  EXPECT_EQ(rig.share(1), 1.0);
}

TEST(StyleCourse, AWishInPlaceOfAnotherReplacesIt) {
  StyleRig rig;
  rig.run(0.2);
  rig.course.wish(kSecond, 0.0);
  rig.course.wish(kThird, 0.0);
  rig.run(1.2);
  EXPECT_EQ(rig.share(1), 0.0);
  EXPECT_EQ(rig.share(2), 1.0);
}

TEST(PelvisVelocity, IsTheStepResponseOfACriticallyDampedLowPass) {
  constexpr double kDt = 1.0 / 200.0, kLambda = 20.0;
  PelvisVelocity smooth(kDt);
  RootPose root;
  root.velocity_H_m_s = {1.0, -0.5};
  root.yaw_rate_rad_s = 0.3;
  for (int n = 1; n <= 200; ++n) {
    smooth.step(root);
    const double t = n * kDt, rise = 1.0 - (1.0 + kLambda * t) * std::exp(-kLambda * t);
    EXPECT_LT((smooth.value() - rise * Eigen::Vector3d(1.0, -0.5, 0.3)).norm(), 1e-12) << t;
  }
}

TEST(PelvisVelocity, FollowsARampATenthOfASecondBehind) {
  PelvisVelocity smooth(1.0 / 200.0);
  RootPose root;
  for (int n = 1; n <= 400; ++n) {
    root.velocity_H_m_s.x() = 0.01 * n;  // 2 m/s²
    smooth.step(root);
  }
  EXPECT_NEAR(smooth.value().x(), 4.0 - 2.0 * 0.1, 0.006);  // held for a step: half a step more
}
}  // namespace
}  // namespace mimesis::synthesizer
