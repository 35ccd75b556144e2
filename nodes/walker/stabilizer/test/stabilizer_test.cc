#include "nodes/walker/stabilizer/stabilizer.h"

#include <gtest/gtest.h>

#include "common/error.h"
#include "common/math/so3.h"
#include "nodes/walker/stabilizer/test/test_biped.h"

namespace mimesis::walker {
namespace {

struct StabilizerTest : ::testing::Test {
  StabilizerTest() {
    robot::Kinematics kinematics(biped.tree);
    kinematics.update(Eigen::Isometry3d::Identity(), biped.half_sitting);
    X_WB.translation() = -kinematics.X_WL(biped.leg[kLeft].sole).translation();
    X_WB.translation().y() = 0.0;
    kinematics.update(X_WB, biped.half_sitting);
    gait.com_height_m = kinematics.com().z();
    plan.pattern = standing(kinematics.com().x());
    for (Side s : robot::kSides) {
      plan.pattern.foot[s].X_WS = kinematics.X_WL(biped.leg[s].sole);
    }
    plan.com = plan.pattern.com;
    plan.X_WB_last = X_WB;
  }
  /// The robot turned about the middle of its feet, which press evenly at `zmp_x_m`.
  Sensors sensors(double tilt_y_rad = 0.0, double zmp_x_m = 0.0) const {
    Eigen::Isometry3d X = X_WB;
    X.prerotate(math::exp_so3({0.0, tilt_y_rad, 0.0}));
    Sensors s = sensors_at(biped, X, biped.half_sitting);
    const double weight = biped.tree.mass_kg() * robot::kGravity;
    for (robot::Wrench& w : s.foot_S) {
      w.force = math::exp_so3({0.0, -tilt_y_rad, 0.0}) * Eigen::Vector3d(0.0, 0.0, 0.5 * weight);
      w.moment.y() = -zmp_x_m * 0.5 * weight;
    }
    return s;
  }
  robot::Biped biped = test_biped();
  GaitSettings gait;
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  StabilizerPlan plan;
  StabilizerSettings settings;
};

TEST_F(StabilizerTest, RobotThatStandsAsPlannedIsLeftAlone) {
  Stabilizer stabilizer(biped, gait, settings);
  const Sensors s = sensors(0.0, plan.pattern.zmp_W_m.x());
  for (int i = 0; i < 100; ++i) stabilizer.step(plan, s);
  const StabilizerCommand& command = stabilizer.step(plan, s);
  EXPECT_LT(command.dcm_error_W_m.norm(), 1e-9);
  EXPECT_LT(command.com_shift_W_m.norm(), 1e-9);
  EXPECT_LT((command.zmp_W_m - plan.pattern.zmp_W_m).norm(), 1e-9);
  for (Side side : robot::kSides) {
    EXPECT_TRUE(command.X_WS[side].isApprox(plan.pattern.foot[side].X_WS, 1e-9));
  }
  EXPECT_EQ(command.reason, "");
  EXPECT_FALSE(command.falling || command.saturated);
}

TEST_F(StabilizerTest, LeaningForwardPressesTheToesAndHoldsTheCentreOfMassBack) {
  Stabilizer stabilizer(biped, gait, settings);
  const Sensors s = sensors(0.02, plan.pattern.zmp_W_m.x());
  for (int i = 0; i < 40; ++i) stabilizer.step(plan, s);
  const StabilizerCommand& command = stabilizer.step(plan, s);
  const double lean = gait.com_height_m * 0.02;
  EXPECT_NEAR(command.dcm_error_W_m.x(), lean, 0.1 * lean);
  EXPECT_NEAR(command.wished_zmp_W_m.x(),
              plan.pattern.zmp_W_m.x() + command.dcm_error_W_m.x() + settings.forward_limit_m,
              0.1 * lean);
  EXPECT_LT(command.com_shift_W_m.x(), -1e-3);
  for (Side side : robot::kSides) {
    EXPECT_GT(math::log_so3(Eigen::Matrix3d(command.X_WS[side].linear())).y(), 0.01);
  }
}

/// An IMU that takes a tilt for upright: the ZMP shows that the robot does not lean.
TEST_F(StabilizerTest, LeanThatTheZmpDoesNotShowIsAnOffset) {
  settings.com_offset_s = 1.0;
  Stabilizer stabilizer(biped, gait, settings);
  const Sensors s = sensors(0.01, plan.pattern.zmp_W_m.x());
  const double lean = stabilizer.step(plan, s).dcm_error_W_m.x();
  EXPECT_NEAR(lean, 0.01 * gait.com_height_m, 0.1 * 0.01 * gait.com_height_m);
  for (int i = 0; i < 4000; ++i) stabilizer.step(plan, s);
  EXPECT_NEAR(stabilizer.step(plan, s).dcm_error_W_m.x(), 0.0, 0.05 * lean);
}

TEST_F(StabilizerTest, MeasurementIsComparedWithThePlanOfItsTime) {
  settings.delay_ticks = 3;
  Stabilizer stabilizer(biped, gait, settings);
  const Sensors s = sensors();
  for (int i = 0; i < 10; ++i) stabilizer.step(plan, s);
  plan.com.p_W_m.x() += 0.01;
  for (int i = 0; i < 3; ++i) EXPECT_LT(stabilizer.step(plan, s).dcm_error_W_m.norm(), 1e-9);
  EXPECT_NEAR(stabilizer.step(plan, s).dcm_error_W_m.x(), -0.01, 1e-9);
}

TEST_F(StabilizerTest, BadSensorsLeaveThePlanAndAReason) {
  Stabilizer stabilizer(biped, gait, settings);
  for (int i = 0; i < 40; ++i) stabilizer.step(plan, sensors(0.02));
  Sensors bad = sensors(0.02);
  bad.q[5] = NAN;
  for (int i = 0; i < 2000; ++i) stabilizer.step(plan, bad);
  const StabilizerCommand& command = stabilizer.step(plan, bad);
  EXPECT_EQ(command.reason, "encoders: a position is not finite");
  EXPECT_FALSE(command.falling);
  EXPECT_LT(command.com_shift_W_m.norm(), 1e-6);
  for (Side side : robot::kSides) {
    EXPECT_TRUE(command.X_WS[side].isApprox(plan.pattern.foot[side].X_WS, 1e-6));
  }
  EXPECT_EQ(stabilizer.step(plan, sensors()).reason, "") << "and come back";
  EXPECT_LT(stabilizer.step(plan, sensors()).dcm_error_W_m.norm(), 1e-6);
}

TEST_F(StabilizerTest, WhoBendsAsItWasSentDoesNotFall) {
  settings.fall_dcm_m = 2.0;
  Stabilizer stabilizer(biped, gait, settings);
  plan.X_WB_last.linear() = math::exp_so3({0.0, 0.7, 0.0});
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(stabilizer.step(plan, sensors(0.7)).falling) << i;
  EXPECT_TRUE(stabilizer.step(plan, sensors()).falling) << "upright is what is wrong";
}

TEST_F(StabilizerTest, FallIsSeenOnceAndForAll) {
  Stabilizer stabilizer(biped, gait, settings);
  EXPECT_FALSE(stabilizer.step(plan, sensors(0.1)).falling);
  EXPECT_TRUE(stabilizer.step(plan, sensors(0.7)).falling);
  EXPECT_EQ(stabilizer.step(plan, sensors()).reason.substr(0, 8), "falling:");
  stabilizer.reset();
  EXPECT_FALSE(stabilizer.step(plan, sensors()).falling);
}

/// A push sideways that the right sole is too small for; the pattern follows it.
TEST_F(StabilizerTest, StepIsAdjustedAndThePatternFollowsWithoutAJump) {
  settings.step_adjustment = true;
  settings.adjust_filter_s = 0.03;  // the law is looked at, not how its filter lags
  settings.adjust_noise_m = 0.0;
  Stabilizer stabilizer(biped, gait, settings);
  Sensors s = sensors();
  s.foot_S[kLeft] = {};
  s.foot_S[kRight].force.z() = biped.tree.mass_kg() * robot::kGravity;
  Eigen::Isometry3d leaning = X_WB;
  leaning.prerotate(math::exp_so3({-0.1, 0.0, 0.0}));  // to the left
  s.R_WI = sensors_at(biped, leaning, biped.half_sitting).R_WI;
  plan.pattern.contact[kLeft] = false;
  plan.pattern.left_share = 0.0;
  plan.pattern.zmp_W_m.y() = -0.095;
  for (double t = 0.7; t > 0.0; t -= kTick_s) {
    plan.pattern.to_landing_s = t;
    EXPECT_TRUE(stabilizer.step(plan, s).pattern_shift_W_m.isZero());
  }
  const StabilizerCommand before = stabilizer.step(plan, s);
  EXPECT_TRUE(before.saturated);
  const double offset =
      before.X_WS[kLeft].translation().y() - plan.pattern.foot[kLeft].X_WS.translation().y();
  EXPECT_GT(offset, 0.05);
  plan.pattern.contact[kLeft] = true;
  plan.pattern.to_landing_s = 0.8;
  plan.pattern.swing = kRight;
  const Eigen::Vector2d shift = stabilizer.step(plan, s).pattern_shift_W_m;
  const double e = before.dcm_error_W_m.y();
  const double cut = before.wished_zmp_W_m.y() - plan.pattern.zmp_W_m.y();
  const double omega = std::sqrt(robot::kGravity / gait.com_height_m);
  EXPECT_NEAR(shift.y(), (e - cut) * std::exp(omega * 0.09) + cut, 5e-3);
  plan.com.p_W_m += shift;
  plan.pattern.com.p_W_m += shift;
  plan.pattern.zmp_W_m += shift;
  for (FootState& foot : plan.pattern.foot) foot.X_WS.translation().head<2>() += shift;
  const StabilizerCommand& after = stabilizer.step(plan, s);
  EXPECT_TRUE(after.pattern_shift_W_m.isZero());
  for (Side side : robot::kSides) {
    EXPECT_LT((after.X_WS[side].translation() - before.X_WS[side].translation()).norm(), 2e-3);
  }
  EXPECT_LT((plan.com.p_W_m + after.com_shift_W_m - (plan.com.p_W_m - shift) - before.com_shift_W_m)
                .norm(),
            2e-3);
}

/// Encoders that show shorter legs than the set-points are compensated.
TEST_F(StabilizerTest, LegsThatGiveWayAreMadeLonger) {
  settings.leg_give_share = 0.5;
  Stabilizer stabilizer(biped, gait, settings);
  Sensors s = sensors(0.0, plan.pattern.zmp_W_m.x());
  for (int i = 0; i < 200; ++i) stabilizer.step(plan, s);
  const double weight = biped.tree.mass_kg() * robot::kGravity, give = 4e-6;
  plan.X_WB_last.translation().z() += give * 0.5 * weight;  // both legs are shorter by c F
  for (int i = 0; i < 4000; ++i) stabilizer.step(plan, s);
  plan.pattern.contact[kLeft] = false;
  plan.pattern.left_share = 0.0;
  plan.pattern.to_landing_s = 0.6;
  const StabilizerCommand& command = stabilizer.step(plan, s);
  EXPECT_NEAR(command.X_WS[kRight].translation().z(),
              plan.pattern.foot[kRight].X_WS.translation().z() - 0.5 * give * 0.5 * weight,
              0.1 * give * weight);
}

/// Set-points show in X_WB_last a tick after they were sent, in the sensors `delay_ticks` after.
TEST_F(StabilizerTest, SwingFootOfARobotThatFollowsExactlyIsLeftAlone) {
  settings.delay_ticks = 3;
  Stabilizer stabilizer(biped, gait, settings);
  plan.pattern.contact[kLeft] = false;
  plan.pattern.left_share = 0.0;
  plan.pattern.to_landing_s = 0.6;
  const auto at = [&](int tick) {
    return math::exp_so3({0.0, 0.05 * std::sin(0.1 * std::max(0, tick - 10)), 0.0});
  };
  for (int k = 1; k < 200; ++k) {
    plan.X_WB_last.linear() = at(k - 1);
    Eigen::Isometry3d X = X_WB;
    X.linear() = at(k - settings.delay_ticks);
    Sensors s = sensors_at(biped, X, biped.half_sitting);
    const StabilizerCommand& command = stabilizer.step(plan, s);
    ASSERT_LT(math::log_so3(Eigen::Matrix3d(command.X_WS[kLeft].linear())).norm(), 1e-6) << k;
  }
}

TEST_F(StabilizerTest, CentreOfPressureOfFeetThatHardlyTouchMeansNothing) {
  Stabilizer stabilizer(biped, gait, settings);
  Sensors s = sensors(0.0, plan.pattern.zmp_W_m.x() + 0.05);
  for (robot::Wrench& w : s.foot_S) w = {0.15 * w.force, 0.15 * w.moment};
  for (int i = 0; i < 20; ++i) stabilizer.step(plan, s);
  EXPECT_EQ(stabilizer.step(plan, s).com_shift_W_m, Eigen::Vector2d::Zero());
}

TEST_F(StabilizerTest, DelayBeyondItsMemoryIsRefused) {
  settings.delay_ticks = 16;
  EXPECT_THROW(Stabilizer(biped, gait, settings), ConfigError);
}

}  // namespace
}  // namespace mimesis::walker
