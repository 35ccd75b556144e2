#include "nodes/walker/stabilizer/balance.h"

#include <gtest/gtest.h>

#include "common/robot/dynamics.h"

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
  s.velocity_filter_s = 0.0;
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
  settings.velocity_filter_s = 0.0;
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

TEST(DcmFeedback, LatePlanIsFilteredAsTheMeasurementIs) {
  StabilizerSettings settings;
  DcmFeedback feedback(kHeight, settings);
  ComState planned;
  planned.v_W = {0.3, 0.0};
  feedback.measure({}, Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero());
  const double share = -std::expm1(-kTick_s / settings.velocity_filter_s);
  feedback.measure(planned, Eigen::Vector2d::Zero(), share * planned.v_W);
  EXPECT_LT(feedback.error_m().norm(), 1e-12);
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
}  // namespace mimesis::walker
