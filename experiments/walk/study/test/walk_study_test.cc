// Pieces of the drawer study: resampling, statistics, reference of played angles, playback.
#include <gtest/gtest.h>

#include "experiments/walk/study/drawer_study.h"
#include "experiments/walk/trial/suites.h"

namespace mimesis::walk {
namespace {

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

/// One foot stands at 0.1 to the left, planned and truly elsewhere; the ZMP is off by `off_m`.
void stand_on(robot::Side side, double off_m, StanceZmp& zmp) {
  walker::WalkerOutput out;
  hw::sim::BodyTruth truth;
  out.pattern.contact[side] = true;
  out.pattern.contact[robot::other(side)] = false;
  out.pattern.foot[side].X_WS.translation().y() = 0.1;
  out.pattern.zmp_W_m.y() = 0.11;
  truth.X_WS[side].translation().y() = 0.3;
  truth.zmp_W_m.y() = 0.31 + off_m;
  zmp.tick(out, truth);
}

TEST(StanceZmp, IsSeenFromTheStandingFootInSingleSupport) {
  StanceZmp zmp;
  stand_on(robot::kLeft, 0.004, zmp);
  EXPECT_NEAR(zmp.std_m(), 0.0, 1e-12) << "feet that stand elsewhere are no spread";
  stand_on(robot::kRight, -0.004, zmp);
  EXPECT_NEAR(zmp.std_m(), 0.004, 1e-12);
  walker::WalkerOutput both;
  both.pattern.contact = {true, true};
  hw::sim::BodyTruth far;
  far.zmp_W_m.y() = 9.0;
  zmp.tick(both, far);
  EXPECT_NEAR(zmp.std_m(), 0.004, 1e-12) << "two feet do not count";
}

TEST(OutcomeOf, TellsWhatWasJudged) {
  TrialResult r;
  r.figures.ankle_pitch_peak_n_m = 99.0;
  r.figures.ankle_pitch_slow_peak_n_m = 12.0;
  r.figures.raw_normal_peak_n = 9000.0;
  r.figures.normal_peak_n = 700.0;
  r.figures.step_error_max_m = 0.004;
  r.figures.step_error_rms_m = 0.002;
  r.trouble = "clipped";
  StanceZmp zmp;
  zmp.add(0.0);
  zmp.add(0.002);
  EXPECT_TRUE(std::isnan(outcome_of(r, zmp).step_error_m)) << "no step, no error of steps";
  r.figures.steps = 6;
  const Outcome o = outcome_of(r, zmp);
  EXPECT_FALSE(o.fell);
  EXPECT_EQ(o.trouble, "clipped");
  EXPECT_EQ(o.ankle_n_m, 12.0);
  EXPECT_EQ(o.normal_n, 700.0);
  EXPECT_EQ(o.step_error_m, 0.004);
  EXPECT_NEAR(o.zmp_std_m, 0.001, 1e-12);
  EXPECT_TRUE(std::isnan(o.reach_error_m)) << "what never came about is no zero";
  r.figures.fell = true;
  r.figures.how = "trunk tilted";
  r.fell_at_s = 3.0;
  const Outcome fallen = outcome_of(r, zmp);
  EXPECT_TRUE(fallen.fell);
  EXPECT_EQ(fallen.trouble, "trunk tilted");
  EXPECT_EQ(fallen.fell_at_s, 3.0);
}

TEST(OutcomeOf, KeepsTheLargestErrorOfAKind) {
  Outcome o;
  o.note_length(synthesizer::kNormalStep, -0.004);
  o.note_length(synthesizer::kNormalStep, 0.001);
  EXPECT_EQ(o.normal_error_m, -0.004);
  EXPECT_TRUE(std::isnan(o.reaching_error_m));
  o.note_length(synthesizer::kReachingStep, 0.002);
  o.note_length(synthesizer::kReachingStep, -0.003);
  EXPECT_EQ(o.reaching_error_m, -0.003);
}

/// Errors refer to the wish, not to the walked path: a wrong wish shows.
TEST(RunScript, ErrorsAreOfTheWish) {
  synthesizer::RobotTrialSettings few;
  few.trials = 4;
  few.paces = {};
  const ScriptRobot robot(biped());
  const auto data = generate_robot_data(biped().biped, few);
  const DrawerGoal goal = goal_of(data, 0);
  DrawerGoal wished = goal;
  wished.normal_m -= 0.05;
  wished.reaching_m += 0.04;
  wished.object_depth_m += 0.03;
  const Outcome o = run_script(robot, rows_of(data, 0), goal, wished);
  EXPECT_FALSE(o.fell) << o.trouble;
  EXPECT_TRUE(o.taken);
  EXPECT_NEAR(o.normal_error_m, 0.05, 0.01);
  EXPECT_NEAR(o.reaching_error_m, -0.04, 0.01);
  EXPECT_NEAR(o.reach_error_m, -0.03, 0.01);
  EXPECT_GT(o.zmp_std_m, 1e-4);
  EXPECT_LT(o.zmp_std_m, 0.03);
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
  EXPECT_NEAR(goals.front().reaching_m, 0.163, 1e-12);
  EXPECT_NEAR(goals.back().reaching_m, 0.359, 1e-12);
  EXPECT_NEAR(goals.front().object_depth_m, 0.124, 1e-12);
  EXPECT_NEAR(goals.back().object_depth_m, 0.273, 1e-12);
  const auto novel = novel_goals();
  ASSERT_EQ(novel.size(), 30U);
  const auto mean = [&](std::size_t from) {
    double sum = 0.0;
    for (std::size_t i = from; i < from + 10; ++i) sum += novel[i].normal_m / 10.0;
    return sum;
  };
  EXPECT_NEAR(mean(0) / mean(10), 0.8, 1e-12) << "the paces of the training trials";
  EXPECT_NEAR(mean(20) / mean(10), 1.2, 1e-12);
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
  EXPECT_FALSE(play(biped(), walked(), {}).figures.fell);
  JointTrack wrong = walked();
  for (std::size_t k = 300; k < wrong.q.size(); ++k) {
    wrong.q[k][biped().biped.leg[0].dof[2]] -= 0.5;  // hip
    wrong.q[k][biped().biped.leg[1].dof[2]] -= 0.5;
  }
  EXPECT_TRUE(play(biped(), wrong, {.feedback = false}).figures.fell);
}

TEST(Playback, GoesOnFromWhereAnAdjustedStepCameDown) {
  for (const double at_s : {2.0, 2.3}) {
    const hw::sim::Push push{.at_s = at_s, .impulse_W_ns = {0.0, 12.0, 0.0}};  // adjusts by 0.12 m
    const TrialResult r = play(biped(), walked(), {}, {&push, 1});
    EXPECT_FALSE(r.figures.fell);
    EXPECT_LT(r.dcm_max_m, 0.8) << "2.7 m if the plan stays where it was";
  }
}

}  // namespace
}  // namespace mimesis::walk
