// Pieces of the drawer study: resampling, statistics, reference of played angles, playback.
#include <gtest/gtest.h>

#include "tools/mimesis/walk/study/drawer_study.h"
#include "tools/mimesis/walk/study/parallel.h"
#include "tools/mimesis/walk/study/stance_zmp.h"

namespace mimesis::walk {
namespace {

using walker::kTick_s;

const Robot& biped() {
  static const Robot robot = load_robot("biped");
  return robot;
}

/// The walker alone, straight ahead.
const JointTrack& walked() {
  static const JointTrack track = [] {
    walker::WalkerSettings settings;
    settings.stabilize = false;
    walker::Walker walker(biped().biped, settings);
    walker::Sensors sensors;
    sensors.q = biped().biped.half_sitting;
    sensors.dq = Eigen::VectorXd::Zero(sensors.q.size());
    walker::WalkerWish wish;
    wish.walk.velocity_m_s.x() = 0.2;
    JointTrack out;
    for (int k = 0; k < 800; ++k) {
      wish.walk.walk = k > 200;
      const walker::WalkerOutput& now = walker.step(wish, sensors);
      out.q.push_back(now.q);
      out.plan.push_back(now.pattern);
    }
    return out;
  }();
  return track;
}

TEST(Resample, TakesOneActionAtEvenPhases) {
  Recording r;
  for (int k = 0; k < 30; ++k) {
    Recording::Tick t;
    t.number = k / 10;
    t.phase = (k % 10) / 10.0;
    t.q = Eigen::VectorXd::Constant(2, k);
    r.ticks.push_back(t);
  }
  const Eigen::MatrixXd rows = resample(r, 1, 20, [](const Recording::Tick& t) { return t.q; });
  ASSERT_EQ(rows.rows(), 2);
  for (int k = 0; k < 20; ++k) EXPECT_NEAR(rows(1, k), 10.0 + 0.5 * k, 1e-12) << k;
  EXPECT_FALSE(r.begin(3));
}

TEST(AtPhase, IsLinearAndGoesOnToTheEnd) {
  Eigen::MatrixXd rows(1, 4);
  rows << 0.0, 1.0, 2.0, 3.0;
  EXPECT_DOUBLE_EQ(at_phase(rows, 0.125)[0], 0.5);
  EXPECT_DOUBLE_EQ(at_phase(rows, 1.0)[0], 4.0);
}

TEST(StanceZmp, IsTheStandardDeviation) {
  StanceZmp zmp;
  EXPECT_EQ(zmp.std_m(), 0.0);
  for (const double v : {1.0, 3.0, 1.0, 3.0}) zmp.add(10.0 + v);
  EXPECT_NEAR(zmp.std_m(), 1.0, 1e-12);
}

TEST(InParallel, KeepsTheOrderAndThrowsOn) {
  const auto squares = in_parallel(50, [](std::size_t i) { return i * i; });
  for (std::size_t i = 0; i < 50; ++i) EXPECT_EQ(squares[i], i * i);
  EXPECT_THROW(in_parallel(3, [](std::size_t i) { return i > 1 ? throw ConfigError("x") : i; }),
               ConfigError);
}

TEST(Goals, SpanTheRangesOfTheDissertation) {
  const auto goals = extreme_goals();
  ASSERT_EQ(goals.size(), 30U);
  EXPECT_NEAR(goals.front().normal_m, 0.505, 1e-12);
  EXPECT_NEAR(goals.back().normal_m, 0.561, 1e-12);
  EXPECT_NEAR(goals.front().reach_m(), 0.663, 1e-12);
  EXPECT_NEAR(goals.back().reach_m(), 0.755, 1e-12);
  EXPECT_EQ(novel_goals().size(), 30U);
}

TEST(ImpliedReference, OfAPlannedWalkIsThatPlan) {
  const auto reference = implied_reference(biped().biped, walked());
  double zmp = 0.0, base = 0.0;
  for (std::size_t k = 250; k + 20 < reference.size(); ++k) {
    const walker::PatternSample& plan = walked().plan[k];
    for (const robot::Side s : robot::kSides) {
      base = std::max(
          base, (reference[k].pattern.foot[s].X_WS.translation() - plan.foot[s].X_WS.translation())
                    .norm());
    }
    zmp = std::max(zmp, std::abs(reference[k].pattern.zmp_W_m.x() - plan.zmp_W_m.x()));
  }
  EXPECT_LT(base, 0.005) << "feet come down where they were planned";
  EXPECT_LT(zmp, 0.10) << "but for the mean over the change of the feet";
}

TEST(Playback, FeasibleAnglesStandWithTheirOwnFeedbackAndWrongOnesFall) {
  EXPECT_FALSE(play(biped(), walked(), Feedback::kOwn).figures.fell);
  JointTrack wrong = walked();
  for (std::size_t k = 300; k < wrong.q.size(); ++k) {
    wrong.q[k][biped().biped.leg[0].dof[2]] -= 0.5;  // hip
    wrong.q[k][biped().biped.leg[1].dof[2]] -= 0.5;
  }
  EXPECT_TRUE(play(biped(), wrong, Feedback::kNone).figures.fell);
}

}  // namespace
}  // namespace mimesis::walk
