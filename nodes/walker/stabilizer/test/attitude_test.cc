#include "nodes/walker/stabilizer/attitude.h"

#include <gtest/gtest.h>

#include <random>

#include "common/robot/dynamics.h"
#include "nodes/walker/stabilizer/settings.h"

namespace mimesis::walker {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

const Vector3d kG_W(0.0, 0.0, robot::kGravity);

double tilt_error_rad(const Quaterniond& estimate, const Quaterniond& truth) {
  const Vector3d up = truth * (estimate.conjugate() * Vector3d::UnitZ());
  return std::acos(std::clamp(up.z(), -1.0, 1.0));
}

/// An IMU whose velocity is known, or not.
AttitudeFilter::Reading at_rest(const Vector3d& gyro_I, const Vector3d& felt_I) {
  return {gyro_I, felt_I, AttitudeFilter::Seen{Vector3d::Zero(), Vector3d::Zero()}};
}

TEST(AttitudeFilter, BeginsUprightAsTheAccelerometerFeels) {
  AttitudeFilter filter(10.0);
  const Quaterniond R(math::exp_so3({0.3, -0.2, 0.0}));
  filter.step(at_rest(Vector3d::Zero(), R.conjugate() * kG_W), kTick_s);
  EXPECT_LT(tilt_error_rad(filter.R_WI(), R), 1e-9);
}

/// A constant rate about any axis: the gyro is integrated exactly, whatever gravity says.
TEST(AttitudeFilter, FollowsAConstantRateExactly) {
  AttitudeFilter filter(10.0);
  const Vector3d rate_I(0.4, -0.7, 0.5);
  Quaterniond R(math::exp_so3({0.1, 0.2, 0.0}));
  filter.step(at_rest(Vector3d::Zero(), R.conjugate() * kG_W), kTick_s);
  const Quaterniond heading = filter.R_WI() * R.conjugate();  // of the start, kept
  for (int i = 0; i < 2000; ++i) {
    R = R * Quaterniond(math::exp_so3(kTick_s * rate_I));
    filter.step(at_rest(rate_I, R.conjugate() * kG_W), kTick_s);
  }
  EXPECT_LT(filter.R_WI().angularDistance(heading * R), 1e-7);
  EXPECT_LT(filter.gyro_bias_I().norm(), 1e-9);
}

/// ε̈ + k ε̇ + l ε = 0 with k = 4/T, l = 6/T²: from rest and a bias b, ε̇ = b at the start, so
/// ε(t) = b/ν exp(−k t/2) sin ν t with ν² = l − k²/4 = 2/T².
TEST(AttitudeFilter, BiasFadesAsTheEquationSays) {
  constexpr double kForget_s = 2.0, kBias = 0.01;
  const double nu = std::sqrt(2.0) / kForget_s;
  AttitudeFilter filter(kForget_s);
  filter.step(at_rest(Vector3d::Zero(), kG_W), kTick_s);
  for (int i = 1; i <= 4000; ++i) {
    filter.step(at_rest({kBias, 0.0, 0.0}, kG_W), kTick_s);
    const double t = i * kTick_s;
    const double expected = kBias / nu * std::exp(-2.0 / kForget_s * t) * std::sin(nu * t);
    const Vector3d tilt = math::log_so3(filter.R_WI());
    ASSERT_NEAR(tilt.x(), expected, 1e-3) << t;  // the low pass of e
    ASSERT_NEAR(tilt.y(), 0.0, 1e-12);
  }
  EXPECT_NEAR(filter.gyro_bias_I().x(), kBias, 1e-5);
}

/// After 3 s of standing the bias is known, even when leaning; a mean of 1 s of readings of
/// deviation σ is off by σ √(Δt/2 s).
TEST(AttitudeFilter, WhoStandsKnowsTheGyrosBias) {
  AttitudeFilter filter(10.0);
  const Vector3d bias(0.009, -0.004, 0.006), lean_I(0.0, 0.02, 0.0);
  constexpr double kNoise = 0.002;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0.0, kNoise);
  Quaterniond R = Quaterniond::Identity();
  for (int i = 0; i < 600; ++i) {
    R = R * Quaterniond(math::exp_so3(kTick_s * lean_I));
    const Vector3d noise(normal(random), normal(random), normal(random));
    filter.step({bias + lean_I + noise, R.conjugate() * kG_W,
                 AttitudeFilter::Seen{Vector3d::Zero(), lean_I}, true},
                kTick_s);
  }
  const double mean = kNoise * std::sqrt(kTick_s / 2.0);
  EXPECT_LT((filter.gyro_bias_I() - bias).norm(), std::exp(-3.0) * bias.norm() + 4.0 * mean);
  const Vector3d known = filter.gyro_bias_I();
  for (int i = 0; i < 20; ++i) {  // a push turns it
    filter.step({bias + Vector3d(0.0, 0.3, 0.0), kG_W, std::nullopt, true}, kTick_s);
  }
  EXPECT_TRUE(filter.gyro_bias_I().isApprox(known, 1e-12));
}

/// Velocities and forces of any motion do not tilt an estimate that is right; one that is wrong by
/// ε₀ follows ε̈ + k ε̇ + l ε = 0 whatever the motion is.
TEST(AttitudeFilter, MotionWithAKnownVelocityDoesNotTilt) {
  constexpr double kForget_s = 5.0, kWrong = 0.01;
  AttitudeFilter right(kForget_s), moving(kForget_s), resting(kForget_s);
  Quaterniond R = Quaterniond::Identity();
  const Quaterniond wrong(math::exp_so3({kWrong, 0.0, 0.0}));
  right.step(at_rest(Vector3d::Zero(), kG_W), kTick_s);
  moving.step(at_rest(Vector3d::Zero(), wrong.conjugate() * kG_W), kTick_s);
  resting.step(at_rest(Vector3d::Zero(), wrong.conjugate() * kG_W), kTick_s);
  Vector3d v_W = Vector3d::Zero();
  for (int i = 0; i < 4000; ++i) {
    const double t = i * kTick_s;
    const Vector3d rate_I(0.2 * std::cos(5.0 * t), 0.1 * std::sin(3.0 * t), 0.05);
    // sway, and a push of 15 N s on 58 kg
    const bool push = i >= 1000 && i < 1020;
    const Vector3d a_W(push ? -2.6 : 0.3 * std::sin(7.0 * t), 0.5 * std::cos(3.9 * t), 0.0);
    R = R * Quaterniond(math::exp_so3(kTick_s * rate_I));
    const Vector3d felt_I = R.conjugate() * (kG_W + a_W);
    const AttitudeFilter::Reading reading{rate_I, felt_I,
                                          AttitudeFilter::Seen{R.conjugate() * v_W, rate_I}};
    right.step(reading, kTick_s);
    moving.step(reading, kTick_s);
    resting.step(at_rest(Vector3d::Zero(), kG_W), kTick_s);
    v_W += kTick_s * a_W;
    ASSERT_LT(tilt_error_rad(right.R_WI(), R), 1e-5) << t;
    ASSERT_NEAR(tilt_error_rad(moving.R_WI(), R),
                tilt_error_rad(resting.R_WI(), Quaterniond::Identity()), 2e-4)
        << t;
  }
}

TEST(AttitudeFilter, KnowsNothingOfUprightInTheAir) {
  AttitudeFilter filter(10.0);
  filter.step(at_rest(Vector3d::Zero(), kG_W), kTick_s);
  for (int i = 0; i < 100; ++i) {
    filter.step({{0.5, 0.0, 0.0}, {0.0, 0.1, 0.0}, std::nullopt}, kTick_s);
  }
  EXPECT_NEAR(math::log_so3(filter.R_WI()).x(), 0.25, 1e-9);
}

}  // namespace
}  // namespace mimesis::walker
