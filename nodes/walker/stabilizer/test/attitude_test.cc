#include "nodes/walker/stabilizer/attitude.h"

#include <gtest/gtest.h>

#include "common/robot/dynamics.h"
#include "common/testing/no_malloc.h"

namespace mimesis::walker {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

const Vector3d kG_W(0.0, 0.0, robot::kGravity);

double tilt_error_rad(const Quaterniond& estimate, const Quaterniond& truth) {
  const Vector3d up = truth * (estimate.conjugate() * Vector3d::UnitZ());
  return std::acos(std::clamp(up.z(), -1.0, 1.0));
}

TEST(AttitudeFilter, BeginsUprightAsTheAccelerometerFeels) {
  AttitudeFilter filter(10.0);
  const Quaterniond R(math::exp_so3({0.3, -0.2, 0.0}));
  filter.step(Vector3d::Zero(), R.conjugate() * kG_W, Vector3d::Zero(), kTick_s);
  EXPECT_LT(tilt_error_rad(filter.R_WI(), R), 1e-9);
}

/// A constant rate about any axis: the gyro is integrated exactly, whatever gravity says.
TEST(AttitudeFilter, FollowsAConstantRateExactly) {
  AttitudeFilter filter(10.0);
  const Vector3d rate_I(0.4, -0.7, 0.5);
  Quaterniond R(math::exp_so3({0.1, 0.2, 0.0}));
  filter.step(Vector3d::Zero(), R.conjugate() * kG_W, Vector3d::Zero(), kTick_s);
  const Quaterniond heading = filter.R_WI() * R.conjugate();  // of the start, kept
  for (int i = 0; i < 2000; ++i) {
    R = R * Quaterniond(math::exp_so3(kTick_s * rate_I));
    filter.step(rate_I, R.conjugate() * kG_W, Vector3d::Zero(), kTick_s);
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
  filter.step(Vector3d::Zero(), kG_W, Vector3d::Zero(), kTick_s);
  for (int i = 1; i <= 4000; ++i) {
    filter.step({kBias, 0.0, 0.0}, kG_W, Vector3d::Zero(), kTick_s);
    const double t = i * kTick_s;
    const double expected = kBias / nu * std::exp(-2.0 / kForget_s * t) * std::sin(nu * t);
    const Vector3d tilt = math::log_so3(filter.R_WI());
    ASSERT_NEAR(tilt.x(), expected, 1e-3) << t;  // the low pass of e
    ASSERT_NEAR(tilt.y(), 0.0, 1e-12);
  }
  EXPECT_NEAR(filter.gyro_bias_I().x(), kBias, 1e-5);
}

/// Sway as in walking: unknown, it tilts the estimate by k a/(g ω); known, not at all.
TEST(AttitudeFilter, KnownAccelerationDoesNotTilt) {
  AttitudeFilter blind(10.0), told(10.0);
  double blind_most = 0.0, told_most = 0.0;
  constexpr double kRate = 3.9;
  for (int i = 0; i < 16'000; ++i) {
    const Vector3d a(0.0, 0.1 * std::cos(kRate * i * kTick_s), 0.0);
    blind.step(Vector3d::Zero(), kG_W + a, Vector3d::Zero(), kTick_s);
    told.step(Vector3d::Zero(), kG_W + a, a, kTick_s);
    if (i < 14'000) continue;  // the start
    blind_most = std::max(blind_most, tilt_error_rad(blind.R_WI(), Quaterniond::Identity()));
    told_most = std::max(told_most, tilt_error_rad(told.R_WI(), Quaterniond::Identity()));
  }
  const double smooth = 1.0 / std::hypot(1.0, 0.1 * kRate);
  const double expected = smooth * 0.4 * 0.1 / robot::kGravity / kRate;
  EXPECT_NEAR(blind_most, expected, 0.1 * expected);
  EXPECT_LT(told_most, 1e-9);
}

/// 15 N s in 0.1 s on 58 kg, which no plan knows.
TEST(AttitudeFilter, APushIsNoTilt) {
  AttitudeFilter filter(10.0);
  for (int i = 0; i < 200; ++i) filter.step(Vector3d::Zero(), kG_W, Vector3d::Zero(), kTick_s);
  double most = 0.0;
  for (int i = 0; i < 200; ++i) {
    const Vector3d a(i < 20 ? -2.6 : 0.0, 0.0, 0.0);
    filter.step(Vector3d::Zero(), kG_W + a, Vector3d::Zero(), kTick_s);
    most = std::max(most, tilt_error_rad(filter.R_WI(), Quaterniond::Identity()));
  }
  EXPECT_LT(most, 0.01);
}

TEST(AttitudeFilter, KnowsNothingOfUprightInFreeFall) {
  AttitudeFilter filter(10.0);
  filter.step(Vector3d::Zero(), kG_W, Vector3d::Zero(), kTick_s);
  const Vector3d rate(0.5, 0.0, 0.0);
  for (int i = 0; i < 100; ++i) filter.step(rate, {0.0, 0.1, 0.0}, Vector3d::Zero(), kTick_s);
  EXPECT_NEAR(math::log_so3(filter.R_WI()).x(), 0.25, 1e-9);
}

TEST(AttitudeFilter, DoesNotAllocate) {
  AttitudeFilter filter(10.0);
  mimesis::testing::NoMalloc guard;
  for (int i = 0; i < 10; ++i) filter.step({0.1, 0, 0}, kG_W, Vector3d::Zero(), kTick_s);
}

TEST(PlannedAcceleration, IsTheSecondDifference) {
  PlannedAcceleration planned(0.0);
  for (int i = 0; i < 50; ++i) {
    const double t = i * kTick_s;
    const Vector3d a = planned.step({0.3 + t, 0.5 * 2.0 * t * t, 0.0});
    EXPECT_LT((a - Vector3d(0.0, i < 2 ? 0.0 : 2.0, 0.0)).norm(), 1e-9) << i;
  }
  planned.reset();
  EXPECT_TRUE(planned.step({9.0, 0.0, 0.0}).isZero(0.0)) << "a new place is no motion";
}

}  // namespace
}  // namespace mimesis::walker
