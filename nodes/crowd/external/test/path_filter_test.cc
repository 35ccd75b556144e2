// Bodies that sway, turn their pelvis and hurry with every step.
#include "nodes/crowd/external/path_filter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/math/circle.h"

namespace mimesis::crowd {
namespace {

using namespace std::chrono_literals;

constexpr double kRate = 5.7, kSway_m = 0.035, kYaw_rad = 0.13, kAway_rad = -0.035;
const SpeedFunction kGait(0.22, std::array{-0.006, 0.023}, std::array{-0.003, 0.022});

/// A walker of the theory, and the body that it has.
struct Walker {
  double heading_rad = 0.4, stride = 1.0, turn_rad_s = 0.0, rate_rad_s = kRate;
  Eigen::Vector2d p_W_m{2.0, -1.0};
  double phase_rad = 0.3;
  std::chrono::nanoseconds now = 10s;

  double speed_m_s() const { return stride * rate_rad_s * kGait(phase_rad); }
  Eigen::Vector2d ahead() const { return {std::cos(heading_rad), std::sin(heading_rad)}; }
  void step(std::chrono::nanoseconds dt = 5ms) {
    const double s = std::chrono::duration<double>(dt).count();
    const double by = s * rate_rad_s;
    p_W_m += stride * (kGait.integral(phase_rad + by) - kGait.integral(phase_rad)) * ahead();
    phase_rad += by;
    heading_rad += s * turn_rad_s;
    now += dt;
  }
  AgentReport body() const {
    const Eigen::Vector2d left(-ahead().y(), ahead().x());
    AgentReport r;
    r.p_W_m = p_W_m + kSway_m * std::sin(phase_rad) * left +
              0.01 * std::cos(6.0 * phase_rad) * ahead();  // not in the theory's g
    r.heading_rad = math::wrap_pi(heading_rad + kAway_rad + kYaw_rad * std::cos(phase_rad));
    r.phase_rad = math::wrap_two_pi(phase_rad);
    r.phase_rate_rad_s = rate_rad_s;
    r.speed_m_s = 1.0;
    return r;
  }
};

/// Largest differences from the walker.
struct Errors {
  double place_m = 0.0, heading_rad = 0.0, speed_m_s = 0.0;
  void add(const AgentReport& found, const Walker& truth) {
    place_m = std::max(place_m, (found.p_W_m - truth.p_W_m).norm());
    heading_rad =
        std::max(heading_rad, std::abs(math::wrap_pi(found.heading_rad - truth.heading_rad)));
    speed_m_s = std::max(speed_m_s, std::abs(found.speed_m_s - truth.speed_m_s()));
  }
};

Errors follow(PathFilter& filter, Walker& walker, double until_s) {
  Errors errors;
  for (const auto end = walker.now + std::chrono::nanoseconds(std::lround(until_s * 1e9));
       walker.now < end; walker.step()) {
    errors.add(filter.step(walker.body(), walker.now, kGait), walker);
  }
  return errors;
}

TEST(PathFilter, FindsTheWalkerInASwayingBody) {
  PathFilter filter;
  Walker walker;
  follow(filter, walker, 2.0);
  const Errors steady = follow(filter, walker, 5.0);
  EXPECT_LT(steady.place_m, 5e-4) << "the body is 3.5 cm beside it";
  EXPECT_LT(steady.heading_rad, 1e-3);
  EXPECT_LT(steady.speed_m_s, 2e-3);
  EXPECT_NEAR(filter.yaw_rad(), kAway_rad, 1e-3);
  EXPECT_NEAR(filter.cycle_m(), kGait.cycle_m(), 1e-4);
}

TEST(PathFilter, LongerStepsAreSeenInTheirLength) {
  PathFilter filter;
  Walker walker{.stride = 1.15};
  follow(filter, walker, 2.0);
  EXPECT_LT(follow(filter, walker, 2.0).place_m, 5e-4);
  EXPECT_NEAR(filter.cycle_m(), 1.15 * kGait.cycle_m(), 1e-4);
}

TEST(PathFilter, ATurnIsFollowedWithoutLag) {
  PathFilter filter;
  Walker walker;
  follow(filter, walker, 3.0);
  walker.turn_rad_s = 0.2;
  const Errors turning = follow(filter, walker, 4.0);
  EXPECT_LT(turning.place_m, 0.03);
  EXPECT_LT(turning.heading_rad, 0.08) << "it turned by 0.8 rad";
}

TEST(PathFilter, WhoStandsIsWhereItIs) {
  PathFilter filter;
  Walker walker{.rate_rad_s = 0.0};
  follow(filter, walker, 1.0);
  AgentReport body = walker.body();
  const AgentReport found = filter.step(body, walker.now, kGait);
  EXPECT_EQ(found.p_W_m, body.p_W_m);
  EXPECT_NEAR(found.heading_rad, body.heading_rad, 1e-12);
  EXPECT_EQ(filter.cycle_m(), 0.0);
}

TEST(PathFilter, WhoBeginsIsNeverFarFromItsBody) {
  PathFilter filter;
  Walker walker{.rate_rad_s = 0.0};
  follow(filter, walker, 1.0);
  walker.rate_rad_s = kRate;  // a step of the speed: worse than any body
  EXPECT_LT(follow(filter, walker, 3.0).place_m, kSway_m + 0.03);
  EXPECT_LT(follow(filter, walker, 1.0).place_m, 5e-4);
}

/// Within half a second, as figures do: means over a cycle would lag by 5 cm and more.
TEST(PathFilter, WhoComesUpToSpeedIsNotLostBehind) {
  PathFilter filter;
  Walker walker{.rate_rad_s = 0.0};
  follow(filter, walker, 1.0);
  double most = 0.0;
  for (int k = 0; k < 400; ++k) {
    walker.rate_rad_s = kRate;
    walker.stride = std::min(1.0, 0.3 + k * 0.005 / 0.8);
    most = std::max(most, follow(filter, walker, 0.005).place_m);
  }
  EXPECT_LT(most, kSway_m + 0.012);
}

TEST(PathFilter, WhoStopsIsWhereItIsAfterAWhile) {
  PathFilter filter;
  Walker walker;
  follow(filter, walker, 3.0);
  walker.rate_rad_s = 0.0;
  follow(filter, walker, 3.1);
  EXPECT_LT((filter.step(walker.body(), walker.now, kGait).p_W_m - walker.body().p_W_m).norm(),
            1e-9);
}

TEST(PathFilter, JumpsAndGapsBeginAnew) {
  PathFilter filter;
  Walker walker;
  follow(filter, walker, 3.0);
  walker.p_W_m.x() += 2.0;
  AgentReport found = filter.step(walker.body(), walker.now, kGait);
  EXPECT_EQ(found.p_W_m, walker.body().p_W_m) << "nothing of before";
  follow(filter, walker, 3.0);
  EXPECT_GT(filter.cycle_m(), 0.0);
  walker.now += 600ms;
  found = filter.step(walker.body(), walker.now, kGait);
  EXPECT_EQ(found.p_W_m, walker.body().p_W_m);
  EXPECT_EQ(filter.cycle_m(), 0.0);
  follow(filter, walker, 3.0);
  walker.phase_rad += 2.0;
  EXPECT_EQ(filter.step(walker.body(), walker.now, kGait).p_W_m, walker.body().p_W_m);
}

TEST(StepGain, LearnsWhatComesOfWhatIsAsked) {
  StepGain gain;
  for (int k = 0; k < 2000; ++k) gain.learn(0.7, 0.7 * 1.03, 0.01);
  EXPECT_NEAR(gain.value(), 1.03, 1e-3);
  for (int k = 0; k < 2000; ++k) gain.learn(0.7, 2.0, 0.01);
  EXPECT_NEAR(gain.value(), 1.25, 1e-3) << "bounded";
  for (int k = 0; k < 100; ++k) gain.learn(0.0, 0.7, 0.01);
  for (int k = 0; k < 100; ++k) gain.learn(0.7, 0.0, 0.01);
  EXPECT_NEAR(gain.value(), 1.25, 1e-3) << "nothing asked, nothing walked: nothing learned";
}

/// A body that follows within half a cycle, and has its mean of the cycle after that.
TEST(StepGain, IsNotTakenInByALateBody) {
  StepGain gain;
  double most = 0.0;
  for (int k = 0; k < 1500; ++k) {
    const auto asked = [](double cycles) { return 0.7 - 0.1 * std::exp(-0.45 * cycles); };
    const double c = 0.01 * k;
    gain.learn(asked(c), asked(std::max(c - 0.8, 0.0)), 0.01);
    most = std::max(most, std::abs(gain.value() - 1.0));
  }
  EXPECT_LT(most, 4e-3);
  for (int k = 0; k < 100; ++k) gain.learn(k % 2 == 0 ? 0.5 : 0.8, 0.7, 0.01);
  EXPECT_NEAR(gain.value(), 1.0, 4e-3) << "what is asked jumps: nothing is learned";
  for (int k = 0; k < 100; ++k) gain.learn(0.7, k % 2 == 0 ? 0.5 : 0.8, 0.01);
  EXPECT_NEAR(gain.value(), 1.0, 4e-3) << "what is walked does";
}

TEST(HeadingTrim, TakesAwayWhatIsLeft) {
  HeadingTrim trim;
  double heading = 0.0;
  for (int k = 0; k < 3000; ++k) {
    trim.learn(0.3, heading, 0.01);
    heading = 0.3 + trim.value_rad() - 0.05;  // the body's own mind
  }
  EXPECT_NEAR(heading, 0.3, 1e-3);
  EXPECT_NEAR(trim.value_rad(), 0.05, 1e-3);
  for (int k = 0; k < 3000; ++k) trim.learn(0.3, -0.3, 0.01);
  EXPECT_NEAR(trim.value_rad(), 0.05, 1e-3) << "still turning";
  for (int k = 0; k < 10000; ++k) trim.learn(0.3, 0.21, 0.01);
  EXPECT_NEAR(trim.value_rad(), 0.2, 1e-12) << "bounded";
}

TEST(SettlingTime, IsThatOfTheRule) {
  EXPECT_NEAR(settling_s({.kind = HeadingKind::lane, .gain = 0.6}, 5.0), 1.0 / 3.0, 1e-12);
  EXPECT_NEAR(settling_s({.kind = HeadingKind::consensus, .gain = 0.5}, 4.0), 0.5, 1e-12);
  EXPECT_NEAR(settling_s({.kind = HeadingKind::goal, .gain = 2.0}, 5.0), 0.5, 1e-12);
  EXPECT_TRUE(std::isinf(settling_s({.kind = HeadingKind::keep}, 5.0)));
  EXPECT_TRUE(std::isinf(settling_s({.kind = HeadingKind::lane, .gain = 0.6}, 0.0)));
}

}  // namespace
}  // namespace mimesis::crowd
