#include "nodes/walker/stabilizer/com_offset.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mimesis::walker {
namespace {

using Eigen::Vector2d;

constexpr double kOmega_1_s = 3.5;

/// c = A sin(νt) walks as c̈ = ω² (c − z) with z = A (1 + ν²/ω²) sin(νt); c is measured off by o,
/// which turns with the robot.
struct ComOffsetTest : ::testing::Test {
  void walk(double seconds, const Vector2d& off_H_m, double turn_rad_s = 0.0) {
    for (int i = 0; i < seconds / kTick_s; ++i, t += kTick_s) {
      yaw += kTick_s * turn_rad_s;
      const Vector2d way(0.03, 0.06);
      constexpr double kSway_1_s = 3.9;
      const Vector2d c = std::sin(kSway_1_s * t) * way,
                     v = kSway_1_s * std::cos(kSway_1_s * t) * way;
      const double share = 1.0 + kSway_1_s * kSway_1_s / (kOmega_1_s * kOmega_1_s);
      offset.measure(c + Eigen::Rotation2Dd(yaw) * off_H_m, v, share * c, yaw);
    }
  }
  StabilizerSettings settings{.com_offset_s = 5.0};
  ComOffset offset{kOmega_1_s, settings};
  double t = 0.0, yaw = 0.0;
};

TEST_F(ComOffsetTest, MotionThatIsMeasuredRightHasNone) {
  walk(20.0, Vector2d::Zero());
  EXPECT_LT(offset.offset_W_m(yaw).norm(), 3e-4);
}

TEST_F(ComOffsetTest, IsFoundAndForgottenWithinItsTime) {
  const Vector2d off(0.008, -0.005);
  const auto missing = [&] {
    return (offset.offset_W_m(yaw) - Eigen::Rotation2Dd(yaw) * off).norm() / off.norm();
  };
  // T grows from 2 s to 5 s: 1/e after 2 s, then 2/t, then e^(−t/5 s)
  walk(2.0, off, 0.2);
  EXPECT_NEAR(missing(), std::exp(-1.0), 0.04);
  walk(3.0, off, 0.2);
  EXPECT_NEAR(missing(), std::exp(-1.0) * 2.0 / 5.0, 0.04);
  walk(10.0, off, 0.2);
  EXPECT_LT(missing(), 0.04);
  walk(5.0, Vector2d::Zero());
  EXPECT_NEAR(offset.offset_W_m(0.0).norm(), off.norm() * std::exp(-1.0), 4e-4);
}

/// 15 N s on 58 kg within 0.1 s: without a limit Δv/(ω² T) = 4.2 mm.
TEST_F(ComOffsetTest, APushIsNone) {
  walk(10.0, Vector2d::Zero());
  const Vector2d before = offset.offset_W_m(yaw);
  Vector2d c = Vector2d::Zero(), v = Vector2d::Zero();
  for (int i = 0; i < 200; ++i) {
    offset.measure(c, v, c, yaw);
    if (i >= 100 && i < 120) v.x() += kTick_s * 2.6;
    c += kTick_s * v;
  }
  EXPECT_LT((offset.offset_W_m(yaw) - before).norm(), 3e-3);
}

TEST_F(ComOffsetTest, AMeasurementAfterAGapIsNoMotion) {
  walk(10.0, Vector2d::Zero());
  const Vector2d before = offset.offset_W_m(yaw);
  offset.lost();
  for (int i = 0; i < 20; ++i) offset.measure({5.0, 0.0}, {0.3, 0.0}, {5.0, 0.0}, yaw);
  EXPECT_LT((offset.offset_W_m(yaw) - before).norm(), 3e-5);
}

TEST_F(ComOffsetTest, WithoutATimeThereIsNone) {
  settings.com_offset_s = 0.0;
  walk(5.0, {0.01, 0.0});
  EXPECT_TRUE(offset.offset_W_m(yaw).isZero(0.0));
}

}  // namespace
}  // namespace mimesis::walker
