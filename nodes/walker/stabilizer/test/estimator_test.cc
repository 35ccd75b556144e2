#include "nodes/walker/stabilizer/estimator.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/math/so3.h"
#include "nodes/walker/stabilizer/settings.h"
#include "nodes/walker/stabilizer/test/test_biped.h"

namespace mimesis::walker {
namespace {

struct EstimatorTest : ::testing::Test {
  EstimatorTest() : q(biped.half_sitting) {
    q[biped.tree.require_joint("left_knee")] += 0.1;  // nothing symmetric
    q[biped.tree.require_joint("waist_yaw")] = 0.3;
    X_WB.translation() = Eigen::Vector3d(1.0, 2.0, 0.65);
    X_WB.linear() = math::exp_so3({0.05, -0.1, 0.7});
  }
  /// The plan that is true: both soles where the robot has them.
  PatternSample true_plan() const {
    robot::Kinematics kinematics(biped.tree);
    kinematics.update(X_WB, q);
    PatternSample plan;
    for (Side s : robot::kSides) plan.foot[s].X_WS = kinematics.X_WL(biped.leg[s].sole);
    return plan;
  }
  Eigen::Vector3d com() const {
    robot::Kinematics kinematics(biped.tree);
    kinematics.update(X_WB, q);
    return kinematics.com();
  }
  /// Estimate from the attitude as it is.
  const BodyEstimate& estimate(Estimator& estimator, const PatternSample& plan) const {
    estimator.see(plan, q, foot_S, Eigen::Vector3d::Zero());
    return estimator.step(plan, sensors_at(biped, X_WB, q).R_WI, foot_S);
  }
  robot::Biped biped = test_biped();
  StabilizerSettings settings;
  std::array<robot::Wrench, 2> foot_S;
  Eigen::VectorXd q;
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
};

TEST_F(EstimatorTest, FindsTheBodyFromTheFeetWhateverTheHeadingOfTheImu) {
  Estimator estimator(biped, settings);
  Sensors sensors = sensors_at(biped, X_WB, q);
  sensors.R_WI = Eigen::Quaterniond(math::exp_so3({0.0, 0.0, 2.9})) * sensors.R_WI;
  for (double share : {0.0, 0.3, 1.0}) {
    PatternSample plan = true_plan();
    plan.left_share = share;
    estimator.see(plan, q, foot_S, Eigen::Vector3d::Zero());
    const BodyEstimate& body = estimator.step(plan, sensors.R_WI, foot_S);
    EXPECT_TRUE(body.X_WB.isApprox(X_WB, 1e-9));
    EXPECT_LT((body.com_W_m - com()).norm(), 1e-9);
  }
}

TEST_F(EstimatorTest, FootThatCarriesCountsByItsShare) {
  Estimator estimator(biped, settings);
  PatternSample plan = true_plan();
  plan.foot[kRight].X_WS.translation().x() += 0.02;  // planned 2 cm farther than it landed
  const auto x_at = [&](double share) {
    plan.left_share = share;
    return estimate(estimator, plan).com_W_m.x() - com().x();
  };
  EXPECT_NEAR(x_at(1.0), 0.0, 1e-9);
  EXPECT_NEAR(x_at(0.25), 0.015, 1e-9);
  plan.contact[kLeft] = false;
  EXPECT_NEAR(x_at(1.0), 0.02, 1e-9);
  EXPECT_LT(estimate(estimator, plan).com_v_W.norm(), 1e-9)
      << "the change of the blend is no motion";
}

TEST_F(EstimatorTest, HeadingOfFeetThatLandedTurnedIsBlendedToo) {
  Estimator estimator(biped, settings);
  PatternSample plan = true_plan();
  plan.foot[kLeft].X_WS.linear() = math::exp_so3({0.0, 0.0, 0.2}) * plan.foot[kLeft].X_WS.linear();
  plan.left_share = 0.25;
  const BodyEstimate& body = estimate(estimator, plan);
  const Eigen::Matrix3d turned = math::exp_so3({0.0, 0.0, 0.25 * 0.2}) * X_WB.linear();
  EXPECT_TRUE(body.X_WB.linear().isApprox(turned, 1e-9));
}

/// The body turns and bends above a foot that stays where it is.
TEST_F(EstimatorTest, ImuMovesAsSeenFromTheFootThatStands) {
  Estimator estimator(biped, settings);
  PatternSample plan = true_plan();
  plan.left_share = 1.0;
  const Eigen::Isometry3d X_WS = plan.foot[kLeft].X_WS;
  Eigen::Isometry3d X_WI_before = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 5; ++i) {
    q[biped.tree.require_joint("left_ankle_roll")] += 2e-3;
    q[biped.tree.require_joint("left_knee")] += 3e-3;
    q[biped.tree.require_joint("waist_yaw")] -= 4e-3;
    q[biped.tree.require_joint("right_hip_pitch")] -= 0.1;  // a swing that does not count
    robot::Kinematics kinematics(biped.tree);
    kinematics.update(Eigen::Isometry3d::Identity(), q);
    const Eigen::Isometry3d X_WI =
        X_WS * kinematics.X_WL(biped.leg[kLeft].sole).inverse() * kinematics.X_WL(biped.imu);
    const Eigen::Vector3d turn_I =
        math::log_so3(Eigen::Matrix3d(X_WI_before.linear().transpose() * X_WI.linear()));
    const auto seen = estimator.see(plan, q, foot_S, i > 0 ? turn_I : Eigen::Vector3d::Zero());
    EXPECT_EQ(seen.has_value(), i > 0);
    if (i > 0) {
      const Eigen::Vector3d v_W = (X_WI.translation() - X_WI_before.translation()) / kTick_s;
      EXPECT_GT(v_W.norm(), 0.1);
      EXPECT_LT((X_WI.linear() * seen->v_I - v_W).norm(), 1e-9);
      EXPECT_LT((kTick_s * seen->rate_I - turn_I).norm(), 1e-9);
    }
    estimator.step(plan, Eigen::Quaterniond(X_WI.linear()), foot_S);
    X_WI_before = X_WI;
  }
}

/// Encoders on the motors' side of springs that the ground's force bends by τ/k. The torques come
/// by virtual work: a small turn of one joint moves the sole against the force.
TEST_F(EstimatorTest, SpringsThatTheEncodersDoNotSeeAreBentByTheGround) {
  settings.hip_stiffness_n_m_rad = 4000.0;
  settings.knee_stiffness_n_m_rad = 3000.0;
  settings.ankle_stiffness_n_m_rad = 2000.0;
  const std::array<double, 6> stiffness{4000.0, 4000.0, 4000.0, 3000.0, 2000.0, 2000.0};
  const PatternSample plan = true_plan();
  const Eigen::VectorXd on_link = q;
  foot_S[kLeft] = {.force = {5.0, -8.0, 100.0}, .moment = {2.0, -3.0, 1.0}};
  foot_S[kRight] = {.force = {-3.0, 4.0, 40.0}, .moment = {-1.0, 1.0, -0.5}};
  robot::Kinematics kinematics(biped.tree);
  const auto X_BS = [&](Side s) {
    kinematics.update(Eigen::Isometry3d::Identity(), q);
    return kinematics.X_WL(biped.leg[s].sole);
  };
  Eigen::VectorXd motor = on_link;
  for (Side s : robot::kSides) {
    const Eigen::Isometry3d before = X_BS(s);
    for (std::size_t i = 0; i < stiffness.size(); ++i) {
      const int dof = biped.leg[s].dof[i];
      constexpr double kTurn = 1e-6;
      q[dof] += kTurn;
      const Eigen::Isometry3d after = X_BS(s);
      q = on_link;
      const Eigen::Vector3d turn =
          math::log_so3(Eigen::Matrix3d(before.linear().transpose() * after.linear()));
      const Eigen::Vector3d shift =
          before.linear().transpose() * (after.translation() - before.translation());
      const double work = foot_S[s].force.dot(shift) + foot_S[s].moment.dot(turn);
      motor[dof] -= work / kTurn / stiffness[i];
    }
  }
  ASSERT_GT((motor - on_link).norm(), 2e-3);
  q = motor;
  Estimator estimator(biped, settings);
  estimator.see(plan, q, foot_S, Eigen::Vector3d::Zero());
  for (Side s : robot::kSides) {
    q = on_link;
    const Eigen::Isometry3d truth = X_BS(s);
    q = motor;
    const double off = (X_BS(s).translation() - truth.translation()).norm();
    ASSERT_GT(off, 3e-4);
    EXPECT_LT((estimator.X_BS(s).translation() - truth.translation()).norm(), 0.02 * off);
  }
}

TEST_F(EstimatorTest, VelocityFollowsTheForceOfTheGround) {
  Estimator estimator(biped, settings);
  const PatternSample plan = true_plan();
  estimate(estimator, plan);
  const Eigen::Vector3d force_W(30.0, -20.0, 500.0);
  robot::Kinematics kinematics(biped.tree);
  kinematics.update(X_WB, q);
  for (Side s : robot::kSides) {
    foot_S[s].force =
        0.5 * kinematics.X_WL(biped.leg[s].sole).linear().transpose() * force_W;  // turned soles
  }
  const Eigen::Vector2d v = kTick_s / biped.tree.mass_kg() * force_W.head<2>();
  EXPECT_LT((estimate(estimator, plan).com_v_W - v).norm(), 1e-9);
}

/// A CoM that is seen elsewhere by d, without a force: v̂ = λ² d t exp(−λ t), two poles at −λ.
TEST_F(EstimatorTest, VelocityComesToTheKinematics) {
  settings.velocity_filter_s = 0.1;  // 20 ticks
  Estimator estimator(biped, settings);
  const PatternSample plan = true_plan();
  estimate(estimator, plan);
  // the trunk turns about the feet: they stay, as the plan says
  const Eigen::Vector3d before = com();
  q[biped.tree.require_joint("waist_pitch")] += 0.001;
  const Eigen::Vector2d d = (com() - before).head<2>();
  ASSERT_GT(d.norm(), 2e-5);
  const double pole = 1.0 / settings.velocity_filter_s;
  Eigen::Vector2d moved = Eigen::Vector2d::Zero();
  for (int i = 1; i <= 800; ++i) {
    const Eigen::Vector2d v = estimate(estimator, plan).com_v_W;
    const double t = i * kTick_s;
    const Eigen::Vector2d wanted = pole * pole * t * std::exp(-pole * t) * d;
    EXPECT_LT((v - wanted).norm(), 0.06 * pole / M_E * d.norm()) << "of the largest, at " << t;
    moved += kTick_s * v;
  }
  EXPECT_LT(estimator.now().com_v_W.norm(), 1e-9);
  EXPECT_LT((moved - d).norm(), 1e-9) << "∫ λ² d t exp(−λ t) dt = d";
}

TEST_F(EstimatorTest, SaysWhichSensorCannotBeUsed) {
  const Estimator estimator(biped, settings);
  const Sensors good = sensors_at(biped, X_WB, q);
  EXPECT_EQ(estimator.unusable(good, false), nullptr);
  EXPECT_EQ(estimator.unusable(good, true), nullptr);
  Sensors bad = good;
  bad.q[3] = NAN;
  EXPECT_STREQ(estimator.unusable(bad, true), "encoders: a position is not finite");
  bad = good;
  bad.q.resize(2);
  EXPECT_STREQ(estimator.unusable(bad, true), "encoders: wrong number of joints");
  bad = good;
  bad.R_WI.coeffs().setZero();
  EXPECT_STREQ(estimator.unusable(bad, true),
               "inertial measurement unit: attitude is not a rotation");
  bad.R_WI.coeffs().setConstant(NAN);
  EXPECT_STREQ(estimator.unusable(bad, true),
               "inertial measurement unit: attitude is not a rotation");
  EXPECT_EQ(estimator.unusable(bad, false), nullptr) << "nobody asks it";
  bad = good;
  bad.gyro_I.y() = NAN;
  EXPECT_STREQ(estimator.unusable(bad, false), "inertial measurement unit: a value is not finite");
  EXPECT_EQ(estimator.unusable(bad, true), nullptr) << "nobody asks it";
  bad = good;
  bad.foot_S[kRight].moment.y() = INFINITY;
  EXPECT_STREQ(estimator.unusable(bad, true), "foot force sensors: a value is not finite");
}

}  // namespace

namespace {

constexpr double kWeight = 570.0, kLeast = 0.2 * kWeight;

TEST(LegGive, IsTheSlopeOfShorteningOverLoad) {
  LegGive give;
  for (int k = 0; k < 800; ++k) {  // the weight goes from one foot to the other
    const double left = 0.5 + 0.5 * std::sin(0.05 * k);
    give.measure(left * kWeight, 3e-6 * left * kWeight);
    give.measure((1.0 - left) * kWeight, 3e-6 * (1.0 - left) * kWeight);
  }
  EXPECT_NEAR(give.m_n(kLeast), 3e-6, 1e-12);
}

TEST(LegGive, LeastSquaresWeighsHeavyLoadsMore) {
  LegGive give;
  for (int k = 0; k < 20'000; ++k) {
    give.measure(400.0, 4e-6 * 400.0);
    give.measure(200.0, 1e-6 * 200.0);
  }
  EXPECT_NEAR(give.m_n(kLeast), (4e-6 * 16.0 + 1e-6 * 4.0) / 20.0, 2e-9);
}

TEST(LegGive, ForgetsAJointThatHasChangedInSeconds) {
  LegGive give;
  for (int k = 0; k < 2000; ++k) give.measure(kWeight, 2e-6 * kWeight);
  const int ticks = static_cast<int>(2.0 / kTick_s);
  for (int k = 0; k < ticks; ++k) give.measure(kWeight, 5e-6 * kWeight);
  EXPECT_NEAR(give.m_n(kLeast), 5e-6 - 3e-6 * std::exp(-1.0), 1e-8);
}

TEST(LegGive, IsNothingBeforeTheLegsBearOrIfTheyGetLonger) {
  LegGive give;
  EXPECT_EQ(give.m_n(kLeast), 0.0);
  for (int k = 0; k < 2000; ++k) give.measure(0.9 * kLeast, 1e-3);
  EXPECT_EQ(give.m_n(kLeast), 0.0);
  for (int k = 0; k < 2000; ++k) give.measure(kWeight, -1e-3);
  EXPECT_EQ(give.m_n(kLeast), 0.0);
  for (int k = 0; k < 4000; ++k) give.measure(kWeight, 0.1);
  EXPECT_EQ(give.m_n(kLeast), 1e-5) << "no leg is so soft: bounded";
  give.reset();
  EXPECT_EQ(give.m_n(kLeast), 0.0);
}

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
