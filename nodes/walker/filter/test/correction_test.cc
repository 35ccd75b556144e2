#include "nodes/walker/filter/correction.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/testing/no_malloc.h"
#include "nodes/walker/pattern/cart_table.h"

namespace mimesis::walker {
namespace {

constexpr double kHeight = 0.8;
constexpr int kSamples = 20, kTicks = 11;

/// A wish that comes and goes, wider in y.
Eigen::RowVector2d bump(double t) {
  const auto bell = [t](double width) { return std::exp(-std::pow((t - 1.2) / width, 2)); };
  return {0.03 * bell(0.15), -0.02 * bell(0.25)};
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
  for (int tick = 0; tick < 600; ++tick) {
    const double t = tick * kTick_s;
    worst = std::max(worst, (zmp(to_com(state), kHeight) - bump(t).transpose()).norm());
    state = correction.next(state, wishes(t));
  }
  EXPECT_LT(worst, 0.0015);       // of 0.036
  EXPECT_LT(state.norm(), 1e-3);  // and it ends where it began
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

TEST(Correction, AxesDoNotMixAndNothingAllocates) {
  const Correction correction(kHeight, kSamples, kTicks);
  Correction::Errors wished = Correction::Errors::Zero(kSamples, 2);
  wished.col(1).setConstant(0.01);
  Correction::State state = Correction::State::Zero();
  const testing::NoMalloc no_malloc;
  for (int i = 0; i < 10; ++i) state = correction.next(state, wished);
  EXPECT_TRUE(state.col(0).isZero(0.0));
  EXPECT_GT(state(0, 1), 0.0);
  EXPECT_EQ(correction.at(5, state, wished).p_W_m.x(), 0.0);
}

}  // namespace
}  // namespace mimesis::walker
