#include "nodes/walker/stabilizer/balance.h"

#include <gtest/gtest.h>

#include "common/robot/dynamics.h"
#include "common/testing/no_malloc.h"
#include "nodes/walker/stabilizer/test/test_biped.h"

namespace mimesis::walker {
namespace {

constexpr double kHeight = 0.8;

/// Linear inverted pendulum c̈ = ω² (c − z), exact over a tick.
struct Pendulum {
  double omega = std::sqrt(robot::kGravity / kHeight);
  Eigen::Vector2d c = Eigen::Vector2d::Zero(), v = Eigen::Vector2d::Zero();
  void step(const Eigen::Vector2d& z) {
    const double ch = std::cosh(omega * kTick_s), sh = std::sinh(omega * kTick_s);
    const Eigen::Vector2d c0 = c - z;
    c = z + ch * c0 + sh / omega * v;
    v = omega * sh * c0 + ch * v;
  }
};

StabilizerSettings without_integral() {
  StabilizerSettings s;
  s.ki_1_s = 0.0;
  s.forward_limit_m = 0.3;
  return s;
}

TEST(DcmFeedback, ErrorOfThePendulumDiesAtTheRateKd) {
  const StabilizerSettings settings = without_integral();
  DcmFeedback feedback(kHeight, settings);
  Pendulum pendulum;
  pendulum.c = {0.02, -0.01};
  const ComState planned;
  double before = 0.0;
  for (int i = 0; i <= 40; ++i) {
    feedback.measure(planned, pendulum.c, pendulum.v);
    if (i == 0) before = feedback.error_m().norm();
    pendulum.step(feedback.step(false, 0.0));
  }
  const double rate = std::log(before / feedback.error_m().norm()) / (40 * kTick_s);
  // e⁺ = e (1 − (exp(ωΔt) − 1) kd/ω) where the ZMP is held for a tick Δt
  const double omega = pendulum.omega;
  const double keep = 1.0 - std::expm1(omega * kTick_s) * settings.kd_1_s / omega;
  EXPECT_NEAR(rate, -std::log(keep) / kTick_s, 1e-6);
  EXPECT_NEAR(rate, settings.kd_1_s, 0.1);
}

TEST(DcmFeedback, LargeErrorsForwardGoBackAtALimitedSpeedSidewaysAtKd) {
  StabilizerSettings settings = without_integral();
  settings.forward_limit_m = 0.01;
  DcmFeedback feedback(kHeight, settings);
  const double omega = feedback.omega_1_s(), yaw = 0.7, e = 0.06;
  const Eigen::Vector2d ahead(std::cos(yaw), std::sin(yaw)), left(-ahead.y(), ahead.x());
  for (const double sign : {1.0, -1.0}) {
    feedback.measure({}, sign * e * ahead, Eigen::Vector2d::Zero());
    EXPECT_LT((feedback.step(false, yaw) - sign * (e + 0.01) * ahead).norm(), 1e-12);
  }
  feedback.measure({}, e * left, Eigen::Vector2d::Zero());
  EXPECT_LT((feedback.step(false, yaw) - (1.0 + settings.kd_1_s / omega) * e * left).norm(), 1e-12);
  feedback.measure({}, 0.007 * ahead, Eigen::Vector2d::Zero());  // kd e < ω × limit
  EXPECT_LT((feedback.step(false, yaw) - (1.0 + settings.kd_1_s / omega) * 0.007 * ahead).norm(),
            1e-12);
}

TEST(DcmFeedback, IntegralTakesAwayAConstantOffset) {
  StabilizerSettings settings;
  const auto left_over = [&](double ki) {
    settings.ki_1_s = ki;
    DcmFeedback feedback(kHeight, settings);
    Pendulum pendulum;
    for (int i = 0; i < 20'000; ++i) {
      feedback.measure({}, pendulum.c, pendulum.v);
      pendulum.step(feedback.step(false, 0.0) + Eigen::Vector2d(0.01, 0.0));  // ZMP 1 cm off
    }
    return feedback.error_m().x();
  };
  const double omega = std::sqrt(robot::kGravity / kHeight);
  EXPECT_NEAR(left_over(0.0), -0.01 * omega / 4.5, 2e-4);
  // at rest e (kd + ki·leak) = -ω·offset
  EXPECT_NEAR(left_over(1.5), -0.01 * omega / (4.5 + 15.0), 2e-4);
}

TEST(DcmFeedback, IntegralForgetsWhileTheFeedbackIsCut) {
  StabilizerSettings settings = without_integral();
  settings.ki_1_s = 1.5;
  DcmFeedback feedback(kHeight, settings);
  feedback.measure({}, {0.1, 0.0}, Eigen::Vector2d::Zero());
  Eigen::Vector2d last = feedback.step(false, 0.0);
  for (int i = 0; i < 5; ++i) {
    const Eigen::Vector2d next = feedback.step(true, 0.0);
    EXPECT_LT(next.x(), last.x());
    last = next;
  }
  EXPECT_GT(feedback.step(false, 0.0).x(), last.x());
}

TEST(ComAdmittance, StandsWhereForceAndSpringAgree) {
  StabilizerSettings settings;
  ComAdmittance admittance(settings);
  for (int i = 0; i < 2000; ++i) admittance.step({0.012, 0.0}, {0.002, 0.004});
  const double gain = settings.com_1_s2 * settings.com_leak_s * settings.com_leak_s;
  EXPECT_NEAR(admittance.shift_m().x(), gain * 0.01, 1e-6);
  EXPECT_NEAR(admittance.shift_m().y(), -gain * 0.004, 1e-6);
  EXPECT_LT(admittance.rate_m_s().norm(), 1e-7);
}

TEST(ComAdmittance, IsLimitedAndComesBackAtOnce) {
  StabilizerSettings settings;
  ComAdmittance admittance(settings);
  for (int i = 0; i < 2000; ++i) admittance.step({1.0, 0.0}, {0.0, 0.0});
  EXPECT_DOUBLE_EQ(admittance.shift_m().x(), settings.com_limit_m);
  admittance.step({-1.0, 0.0}, {0.0, 0.0});
  EXPECT_LT(admittance.shift_m().x(), settings.com_limit_m);
}

}  // namespace

namespace {

using Eigen::Vector2d;

constexpr double kOmega = 3.5;

struct AdjustmentTest : ::testing::Test {
  AdjustmentTest() {
    settings.step_adjustment = true;
    settings.adjust_filter_s = settings.adjust_noise_m = 0.0;
    settings.adjust_speed_m_s = 10.0;
  }
  /// A swing of the left foot, from the lift-off to `until_s` before the landing.
  void swing(StepAdjustment& a, double until_s, const Vector2d& error, const Vector2d& change,
             bool cut) {
    plan.contact = {false, true};
    plan.swing = kLeft;
    for (double t = 0.7; t > until_s + 1e-9; t -= kTick_s) {
      plan.to_landing_s = t;
      a.follow();
      EXPECT_EQ(a.step(plan, {error, change, cut, kOmega}), Vector2d::Zero());
    }
  }
  Vector2d land(StepAdjustment& a) {
    plan.contact = {true, true};
    plan.to_landing_s = 0.8;
    a.follow();
    return a.step(plan, {Vector2d::Zero(), Vector2d::Zero(), false, kOmega});
  }
  StabilizerSettings settings;
  PatternSample plan = standing();
};

TEST_F(AdjustmentTest, FootGoesWhereThePendulumWillBeAtTheLanding) {
  StepAdjustment a(settings);
  const Vector2d error(0.058, 0.062), change(0.05, 0.054);
  swing(a, 0.3, error, change, true);
  const double t = plan.to_landing_s;
  // ξ̇ = ω (ξ − z) with z held: the error at the landing, exactly
  Vector2d e = error;
  const int n = 10'000;
  for (int i = 0; i < n; ++i) e += t / n * kOmega * (e - change);
  EXPECT_LT((a.foot_W_m(kLeft) - e).norm(), 1e-5);
  EXPECT_EQ(a.foot_W_m(kRight), Vector2d::Zero());
}

/// A push from the side cuts the ZMP across; along the feedback takes more than e, and it is
/// enough.
TEST_F(AdjustmentTest, WhatTheSolesCanDoAloneMovesNoFoot) {
  const double grow = std::exp(kOmega * 0.3);
  for (const double sign : {1.0, -1.0}) {
    StepAdjustment a(settings);
    swing(a, 0.3, sign * Vector2d(0.005, 0.06), sign * Vector2d(0.016, 0.05), true);
    EXPECT_EQ(a.foot_W_m(kLeft).x(), 0.0);
    const double across = std::clamp(sign * (0.01 * grow + 0.05), -settings.adjust_inward_m, 1.0);
    EXPECT_NEAR(a.foot_W_m(kLeft).y(), across, 2e-3);
  }
  // d against e, as where the wished ZMP was near the edge before: nothing takes e away
  StepAdjustment against(settings);
  swing(against, 0.3, {0.02, 0.0}, {-0.005, 0.0}, true);
  EXPECT_NEAR(against.foot_W_m(kLeft).x(), 0.025 * grow - 0.005, 2e-3);
  // along the heading, not along W
  plan.yaw_rad = M_PI / 4.0;
  const Eigen::Rotation2Dd R_WH(plan.yaw_rad);
  StepAdjustment turned(settings);
  swing(turned, 0.3, R_WH * Vector2d(0.005, 0.03), R_WH * Vector2d(0.016, 0.025), true);
  EXPECT_NEAR((R_WH.inverse() * turned.foot_W_m(kLeft)).x(), 0.0, 1e-12);
  EXPECT_GT((R_WH.inverse() * turned.foot_W_m(kLeft)).y(), 0.03);
}

TEST_F(AdjustmentTest, OnlyWhenTheSolesAreTooSmallAndInTime) {
  const Vector2d error(0.06, 0.06), change(0.05, 0.05);
  StepAdjustment uncut(settings);
  swing(uncut, 0.0, error, change, false);
  EXPECT_EQ(uncut.foot_W_m(kLeft), Vector2d::Zero());
  StepAdjustment early(settings);
  swing(early, 0.56, error, change, true);
  EXPECT_EQ(early.foot_W_m(kLeft), Vector2d::Zero());
  StepAdjustment late(settings);
  swing(late, 0.09, error, change, true);
  const Vector2d before = late.foot_W_m(kLeft);
  EXPECT_GT(before.norm(), 0.01);
  plan.to_landing_s = 0.08;
  late.follow();
  late.step(plan, {5.0 * error, change, true, kOmega});
  EXPECT_EQ(late.foot_W_m(kLeft), before);
  settings.step_adjustment = false;
  StepAdjustment off(settings);
  swing(off, 0.0, error, change, true);
  EXPECT_EQ(off.foot_W_m(kLeft), Vector2d::Zero());
}

/// An error within the noise moves nothing, a larger one by what is certain, either way.
TEST_F(AdjustmentTest, NoiseMovesNoFoot) {
  const double grow = std::exp(kOmega * 0.3), noise = 0.008;
  const Vector2d change(0.01, 0.01);
  const auto moved = [&](double beyond_x, double beyond_y) -> Vector2d {
    settings.adjust_noise_m = noise;
    StepAdjustment a(settings);
    const Vector2d error(change.x() + beyond_x, change.y() + beyond_y);
    swing(a, 0.3, error, change, true);
    return a.foot_W_m(kLeft);
  };
  const double share = change.x() / grow;  // e_T = 0 where e - d is -d exp(-w t)
  EXPECT_EQ(moved(0.99 * noise - share, 0.99 * noise - share), Vector2d::Zero());
  EXPECT_NEAR(moved(noise + 0.01, 0.0).x(), 0.01 * grow + change.x(), 2e-3);
  EXPECT_NEAR(moved(0.0, noise + 0.01).y(), 0.01 * grow + change.y(), 2e-3);
  EXPECT_NEAR(moved(-noise - 0.03, 0.0).x(), -0.03 * grow + change.x(), 2e-3);
}

TEST_F(AdjustmentTest, StaysWithinReachOfTheHeading) {
  plan.yaw_rad = M_PI / 2.0;  // forward is W's y, outward of the left foot −x
  StepAdjustment far(settings), inward(settings);
  swing(far, 0.3, {-0.5, -0.5}, Vector2d::Zero(), true);
  EXPECT_LT((far.foot_W_m(kLeft) - Vector2d(-settings.adjust_outward_m, -settings.adjust_forward_m))
                .norm(),
            1e-9);
  swing(inward, 0.3, {0.5, 0.5}, Vector2d::Zero(), true);
  EXPECT_LT((inward.foot_W_m(kLeft) - Vector2d(settings.adjust_inward_m, settings.adjust_forward_m))
                .norm(),
            1e-9);
}

TEST_F(AdjustmentTest, OutwardOfTheRightFootIsToTheRight) {
  plan.contact = {true, false};
  plan.swing = kRight;
  plan.to_landing_s = 0.3;
  StepAdjustment out(settings), in(settings);
  for (int i = 0; i < 40; ++i) {
    out.step(plan, {{0.0, -0.5}, Vector2d::Zero(), true, kOmega});
    in.step(plan, {{0.0, 0.5}, Vector2d::Zero(), true, kOmega});
  }
  EXPECT_NEAR(out.foot_W_m(kRight).y(), -settings.adjust_outward_m, 1e-9);
  EXPECT_NEAR(in.foot_W_m(kRight).y(), settings.adjust_inward_m, 1e-9);
}

TEST_F(AdjustmentTest, IsFilteredAndNoFasterThanItsSpeed) {
  settings.adjust_filter_s = 0.03;
  settings.adjust_speed_m_s = 1.0;
  StepAdjustment a(settings);
  swing(a, 0.5, {0.5, 0.0}, Vector2d::Zero(), true);  // due from 0.55 s on
  EXPECT_NEAR(a.foot_W_m(kLeft).x(), 10 * kTick_s * 1.0, 1e-9);
  settings.adjust_speed_m_s = 10.0;
  StepAdjustment slow(settings);
  swing(slow, 0.525, {0.5, 0.0}, Vector2d::Zero(), true);
  EXPECT_NEAR(slow.foot_W_m(kLeft).x(), 0.12 * -std::expm1(-5 * kTick_s / 0.03), 1e-9);
}

TEST_F(AdjustmentTest, PatternMovesWithTheFootAndNothingThatTheLegsTrackJumps) {
  StepAdjustment a(settings);
  swing(a, 0.0, {0.06, 0.06}, {0.05, 0.05}, true);
  const Vector2d offset = a.foot_W_m(kLeft);
  ASSERT_GT(offset.norm(), 0.02);
  EXPECT_EQ(land(a), offset);
  EXPECT_EQ(a.foot_W_m(kLeft), offset) << "the plan of this tick has not moved";
  // next tick: the plan has moved by the offset
  a.follow();
  EXPECT_EQ(a.foot_W_m(kLeft), Vector2d::Zero());
  EXPECT_EQ(a.foot_W_m(kRight), -offset) << "stands where it stood";
  EXPECT_LT((a.com_W_m() + offset).norm(), 2e-3 * offset.norm());
  EXPECT_EQ(a.step(plan, {}), Vector2d::Zero()) << "moves once";
  // the CoM follows, critically damped: (1 + t/T) exp(−t/T)
  const int ticks = 100;
  for (int i = 1; i < ticks; ++i) a.follow(), a.step(plan, {});
  const double u = ticks * kTick_s / settings.com_leak_s;
  EXPECT_NEAR(a.com_W_m().x() / -offset.x(), (1.0 + u) * std::exp(-u), 0.01);
  EXPECT_NEAR(a.com_v_W().x() / offset.x(), u * std::exp(-u) / settings.com_leak_s, 0.02);
  EXPECT_EQ(a.foot_W_m(kRight), -offset) << "until its next swing";
  plan.contact = {true, false};
  plan.swing = kRight;
  plan.to_landing_s = 0.4;
  settings.adjust_filter_s = 0.03;
  for (int i = 0; i < 100; ++i) a.follow(), a.step(plan, {});
  EXPECT_LT(a.foot_W_m(kRight).norm(), 1e-9);
}

/// Pushed robots land early, and their feet were led on over the ground.
TEST_F(AdjustmentTest, AFootThatBearsStaysWhereItTouched) {
  StepAdjustment a(settings);
  swing(a, 0.2, {0.06, 0.06}, {0.05, 0.05}, true);
  Vector2d planned = plan.foot[kLeft].X_WS.translation().head<2>();
  const Vector2d touched = planned + a.foot_W_m(kLeft);
  for (int i = 0; i <= 30; ++i) {
    a.follow();
    plan.to_landing_s -= kTick_s;
    plan.foot[kLeft].X_WS.translation().head<2>() = planned + a.foot_W_m(kLeft);
    a.step(plan, {{-0.3, 0.3}, Vector2d::Zero(), true, kOmega, {i > 0, false}});
    if (i > 0) {
      EXPECT_LT((planned + a.foot_W_m(kLeft) - touched).norm(), 1e-9);
    }
    planned.x() += 0.001;  // the plan is still on its way
  }
  const Vector2d offset = a.foot_W_m(kLeft);
  EXPECT_EQ(land(a), offset) << "the pattern goes on from where it is";
}

TEST_F(AdjustmentTest, ForgetsAndDoesNotAllocate) {
  StepAdjustment a(settings);
  swing(a, 0.2, {0.06, 0.06}, {0.05, 0.05}, true);
  a.reset();
  EXPECT_EQ(a.foot_W_m(kLeft), Vector2d::Zero());
  EXPECT_EQ(land(a), Vector2d::Zero()) << "of a foot that was never seen in the air";
  mimesis::testing::NoMalloc guard;
  swing(a, 0.0, {0.06, 0.06}, {0.05, 0.05}, true);
  land(a);
}

}  // namespace

}  // namespace mimesis::walker
