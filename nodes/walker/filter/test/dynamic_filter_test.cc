#include "nodes/walker/filter/dynamic_filter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/robot/test/test_bipeds.h"
#include "common/testing/no_malloc.h"
#include "nodes/walker/filter/test/plain_walk.h"
#include "nodes/walker/pattern/generators.h"
#include "nodes/walker/pattern/preview_control.h"
#include "nodes/walker/testing/filtered_walk.h"

namespace mimesis::walker {
namespace {

constexpr double kHeight = 0.8;
constexpr int kSamples = 20, kTicks = 11;

/// A wish of an angular momentum that comes and goes, wider in y: its sum is none.
Eigen::RowVector2d bump(double t) {
  const auto rate = [t](double width) {
    const double u = (t - 1.5) / width;
    return -2.0 * u * std::exp(-u * u);
  };
  return {0.03 * rate(0.25), -0.02 * rate(0.4)};
}

Correction::Errors wishes(double t) {
  Correction::Errors out(kSamples, 2);
  for (int k = 0; k < kSamples; ++k) out.row(k) = bump(t + k * kTicks * kTick_s);
  return out;
}

TEST(Correction, ZmpOfTheShiftIsTheWishedChange) {
  const Correction correction(kHeight, kSamples, kTicks);
  Correction::State state = Correction::State::Zero();
  double worst = 0.0;
  for (int tick = 0; tick < 2400; ++tick) {
    const double t = tick * kTick_s;
    worst = std::max(worst, (zmp(to_com(state), kHeight) - bump(t).transpose()).norm());
    state = correction.next(state, wishes(t));
  }
  EXPECT_LT(worst, 0.0015);       // 0.036 before
  EXPECT_LT(state.norm(), 1e-3);  // the shift ends at its start, once the sum is forgotten
}

TEST(Correction, PredictsWhatItDoes) {
  const Correction correction(kHeight, kSamples, kTicks);
  Correction::State state = Correction::State::Zero();
  for (int tick = 0; tick < 120; ++tick) state = correction.next(state, wishes(tick * kTick_s));
  const Correction::Errors seen = wishes(120 * kTick_s);
  EXPECT_LT((correction.at(0, state, seen).p_W_m - to_com(state).p_W_m).norm(), 1e-15);
  std::vector<ComState> predicted;
  for (int k = 0; k < 8; ++k) predicted.push_back(correction.at(k, state, seen));
  for (int tick = 0; tick < 7 * kTicks + 1; ++tick) {
    if (tick % kTicks == 0) {
      const ComState now = to_com(state),
                     &then = predicted[static_cast<std::size_t>(tick / kTicks)];
      EXPECT_LT((now.p_W_m - then.p_W_m).norm(), 2e-4) << tick;
      EXPECT_LT((now.a_W - then.a_W).norm(), 0.02) << tick;
    }
    state = correction.next(state, wishes((120 + tick) * kTick_s));
  }
}

TEST(Correction, TellsTheNextTickWhereSamplesWillBe) {
  const Correction correction(kHeight, kSamples, kTicks);
  Correction::State state = Correction::State::Zero();
  for (int tick = 0; tick < 120; ++tick) state = correction.next(state, wishes(tick * kTick_s));
  const Correction::Errors seen = wishes(120 * kTick_s);
  const ComState next = to_com(correction.next(state, seen));
  EXPECT_LT((correction.at_in_next_tick(0, state, seen).p_W_m - next.p_W_m).norm(), 1e-15);
  EXPECT_LT((correction.at_in_next_tick(0, state, seen).a_W - next.a_W).norm(), 1e-13);
  for (int k = 0; k < kSamples; ++k) {
    const ComState at = correction.at(k, state, seen),
                   later = correction.at_in_next_tick(k, state, seen);
    const Eigen::Vector2d moved = kTick_s * (at.v_W + later.v_W) / 2.0;
    EXPECT_LT((later.p_W_m - at.p_W_m - moved).norm(), 1e-6) << k;
    EXPECT_GT(at.v_W.norm(), 1e-3) << k;
  }
}

/// A wave of this period, from its top or its middle on, is followed with a window that ends within
/// it. @return the largest error, by the wave, once it has gone on for a while
double error_of_wave(double period_s, double phase_rad) {
  constexpr int kShortTicks = 7;  // a window of 0.7 s
  const Correction correction(kHeight, kSamples, kShortTicks);
  const double w = 2.0 * M_PI / period_s;
  const auto wave = [&](double t) { return std::sin(w * t + phase_rad); };
  Correction::State state = Correction::State::Zero();
  double worst = 0.0;
  Correction::Errors seen = Correction::Errors::Zero(kSamples, 2);
  for (int tick = 0; tick < 3000; ++tick) {
    const double t = tick * kTick_s;
    if (t > 9.0) worst = std::max(worst, std::abs(zmp(to_com(state), kHeight).x() - wave(t)));
    for (int k = 0; k < kSamples; ++k) seen(k, 0) = wave(t + k * kShortTicks * kTick_s);
    state = correction.next(state, seen);
  }
  return worst;
}

TEST(Correction, WhatComesPastTheWindowTakesTheSumAway) {
  // steps of 0.8 s, and a period of two of them; from the top a wave has a mean to forget
  EXPECT_LT(error_of_wave(0.8, 0.0), 0.09);
  EXPECT_LT(error_of_wave(1.6, 0.0), 0.11);
  EXPECT_LT(error_of_wave(0.8, M_PI / 2.0), 0.09);
  EXPECT_LT(error_of_wave(1.6, M_PI / 2.0), 0.11);
}

TEST(Correction, AxesDoNotMixAndNothingAllocates) {
  const Correction correction(kHeight, kSamples, kTicks);
  Correction::Errors wished = Correction::Errors::Zero(kSamples, 2);
  wished.col(1).setConstant(0.01);
  Correction::State state = Correction::State::Zero();
  const mimesis::testing::NoMalloc no_malloc;
  for (int i = 0; i < 10; ++i) state = correction.next(state, wished);
  EXPECT_TRUE(state.col(0).isZero(0.0));
  EXPECT_GT(state(0, 1), 0.0);
  EXPECT_EQ(correction.at(5, state, wished).p_W_m.x(), 0.0);
}

}  // namespace

namespace {

TEST(DynamicFilter, OneIterationTakesAwayMostOfTheError) {
  const robot::Biped biped = robot::hrp2_like();
  for (const double arms : {0.0, 1.0}) {
    const FilteredWalk walk = filtered_walk(biped, 0.3, arms, {});
    const Eigen::Vector2d ratio = walk.rms_before_m().cwiseQuotient(walk.rms_after_m());
    EXPECT_GT(ratio.x(), 6.0);
    EXPECT_GT(ratio.y(), 3.0);
    EXPECT_GT(walk.rms_before_m().x(), 0.02);  // there is an error to reduce
    EXPECT_GT(walk.rms_before_m().y(), 0.005);
    EXPECT_EQ(walk.unreachable, 0);
  }
}

TEST(DynamicFilter, ConvergesOverTheTicks) {
  const robot::Biped biped = robot::hrp2_like();
  const Eigen::Vector2d one = filtered_walk(biped, 0.3, 1.0, {}).rms_after_m(),
                        two = filtered_walk(biped, 0.3, 1.0, {.iterations = 2}).rms_after_m();
  EXPECT_LT(one.x(), 0.0014);
  EXPECT_LT(one.y(), 0.0008);
  EXPECT_LT((one - two).norm(), 3e-5);
}

TEST(DynamicFilter, LegsOnlyIsWorseWhenTheArmsMove) {
  const robot::Biped biped = robot::hrp2_like();
  const Eigen::Vector2d full = filtered_walk(biped, 0.3, 1.0, {}).rms_after_m(),
                        legs = filtered_walk(biped, 0.3, 1.0, {.legs_only = true}).rms_after_m();
  EXPECT_GT(legs.x(), 1.3 * full.x());
  EXPECT_GT(legs.y(), 1.3 * full.y());
  const Eigen::Vector2d still = filtered_walk(biped, 0.3, 0.0, {}, 6.0).rms_after_m(),
                        same =
                            filtered_walk(biped, 0.3, 0.0, {.legs_only = true}, 6.0).rms_after_m();
  EXPECT_EQ(still, same);
}

TEST(DynamicFilter, AnotherRobotIsFilteredAsWell) {
  const auto biped = robot::jvrc1();
  if (!biped) GTEST_SKIP() << "not here: needs data/robots/jvrc1.urdf of the shared folder";
  const FilteredWalk walk = filtered_walk(*biped, 0.2, 0.0, {});
  EXPECT_GT(walk.rms_before_m().x(), 3.0 * walk.rms_after_m().x());
  EXPECT_GT(walk.rms_before_m().y(), 2.0 * walk.rms_after_m().y());
}

TEST(DynamicFilter, StandingRobotIsLeftAlone) {
  const robot::Biped biped = robot::hrp2_like();
  const GaitSettings gait = gait_settings(biped);
  LinearMpc pattern(gait);
  pattern.reset(stance(biped));
  DynamicFilter filter(biped, gait, {.iterations = 2});
  UpperBody upper;
  SwingingArms(biped, 0.0).at(0.0, upper);
  Wish still;
  still.walk = false;
  for (int i = 0; i < 200; ++i) {
    pattern.step(still);
    EXPECT_LT(filter.step(pattern, {&upper, 1}).p_W_m.norm(), 1e-4);
  }
}

TEST(DynamicFilter, OneUpperBodyIsTheSameAllAlong) {
  const robot::Biped biped = robot::hrp2_like();
  const GaitSettings gait = gait_settings(biped);
  LinearMpc pattern(gait);
  pattern.reset(stance(biped));
  DynamicFilter one(biped, gait, {}), all(biped, gait, {});
  std::vector<UpperBody> upper(20);
  SwingingArms(biped, 1.0).at(3.3, upper[0]);
  for (UpperBody& u : upper) u = upper[0];
  for (int i = 0; i < 300; ++i) {
    pattern.step(wish(0.2));
    const ComState a = one.step(pattern, {upper.data(), 1}), b = all.step(pattern, upper);
    ASSERT_EQ(a.p_W_m, b.p_W_m);
    ASSERT_EQ(a.a_W, b.a_W);
  }
}

TEST(DynamicFilter, LegsTooShortAreCountedAndTheShiftStaysSmall) {
  const robot::Biped biped = robot::hrp2_like();
  GaitSettings gait = gait_settings(biped);
  gait.com_height_m = 0.84;
  LinearMpc pattern(gait);
  pattern.reset(stance(biped));
  DynamicFilter filter(biped, gait, {});
  UpperBody upper;
  SwingingArms(biped, 0.5).at(1.0, upper);
  int unreachable = 0;
  for (int i = 0; i < 1200; ++i) {
    pattern.step(wish(0.33));
    const ComState shift = filter.step(pattern, {&upper, 1});
    EXPECT_LT(shift.p_W_m.norm(), 0.05) << i;
    EXPECT_LT(shift.a_W.norm(), 3.0) << i;
    unreachable += filter.unreachable();
  }
  EXPECT_GT(unreachable, 100);
}

TEST(DynamicFilter, BeginsAnewAfterReset) {
  const robot::Biped biped = robot::hrp2_like();
  const GaitSettings gait = gait_settings(biped);
  DynamicFilter filter(biped, gait, {});
  UpperBody upper;
  SwingingArms(biped, 0.0).at(0.0, upper);
  std::array<std::vector<Eigen::Vector2d>, 2> shifts;
  for (auto& run : shifts) {
    LinearMpc pattern(gait);
    pattern.reset(stance(biped));
    filter.reset();
    for (int i = 0; i < 400; ++i) {
      pattern.step(wish(0.2));
      run.push_back(filter.step(pattern, {&upper, 1}).p_W_m);
    }
  }
  EXPECT_EQ(shifts[0], shifts[1]);
  EXPECT_GT(shifts[0].back().norm(), 1e-3);
}

}  // namespace

}  // namespace mimesis::walker
