#include "nodes/walker/stabilizer/estimator.h"

#include <gtest/gtest.h>

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
  robot::Biped biped = test_biped();
  StabilizerSettings settings;
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
    const BodyEstimate& body = estimator.step(plan, sensors);
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
    return estimator.step(plan, sensors_at(biped, X_WB, q)).com_W_m.x() - com().x();
  };
  EXPECT_NEAR(x_at(1.0), 0.0, 1e-9);
  EXPECT_NEAR(x_at(0.25), 0.015, 1e-9);
  plan.contact[kLeft] = false;
  EXPECT_NEAR(x_at(1.0), 0.02, 1e-9);
  EXPECT_LT(estimator.step(plan, sensors_at(biped, X_WB, q)).com_v_W.norm(), 1e-9)
      << "the change of the blend is no motion";
}

TEST_F(EstimatorTest, HeadingOfFeetThatLandedTurnedIsBlendedToo) {
  Estimator estimator(biped, settings);
  PatternSample plan = true_plan();
  plan.foot[kLeft].X_WS.linear() = math::exp_so3({0.0, 0.0, 0.2}) * plan.foot[kLeft].X_WS.linear();
  plan.left_share = 0.25;
  const BodyEstimate& body = estimator.step(plan, sensors_at(biped, X_WB, q));
  const Eigen::Matrix3d turned = math::exp_so3({0.0, 0.0, 0.25 * 0.2}) * X_WB.linear();
  EXPECT_TRUE(body.X_WB.linear().isApprox(turned, 1e-9));
}

TEST_F(EstimatorTest, VelocityIsTheFilteredDifference) {
  Estimator estimator(biped, settings);
  const PatternSample plan = true_plan();
  estimator.step(plan, sensors_at(biped, X_WB, q));
  // the trunk turns about the feet: they stay, as the plan says
  const Eigen::Vector3d before = com();
  const double share = low_pass_share(settings.velocity_filter_s);
  q[biped.tree.require_joint("waist_pitch")] += 0.001;
  const Eigen::Vector2d v = (com() - before).head<2>() / kTick_s;
  ASSERT_GT(v.norm(), 0.005);
  EXPECT_LT((estimator.step(plan, sensors_at(biped, X_WB, q)).com_v_W - share * v).norm(), 1e-9);
  for (int i = 0; i < 40; ++i) estimator.step(plan, sensors_at(biped, X_WB, q));
  EXPECT_LT(estimator.step(plan, sensors_at(biped, X_WB, q)).com_v_W.norm(), 1e-6);
}

TEST_F(EstimatorTest, SaysWhichSensorCannotBeUsed) {
  const Estimator estimator(biped, settings);
  const Sensors good = sensors_at(biped, X_WB, q);
  EXPECT_EQ(estimator.unusable(good), nullptr);
  Sensors bad = good;
  bad.q[3] = NAN;
  EXPECT_STREQ(estimator.unusable(bad), "encoders: a position is not finite");
  bad = good;
  bad.q.resize(2);
  EXPECT_STREQ(estimator.unusable(bad), "encoders: wrong number of joints");
  bad = good;
  bad.R_WI.coeffs().setZero();
  EXPECT_STREQ(estimator.unusable(bad), "inertial measurement unit: attitude is not a rotation");
  bad = good;
  bad.foot_S[kRight].moment.y() = INFINITY;
  EXPECT_STREQ(estimator.unusable(bad), "foot force sensors: a value is not finite");
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

}  // namespace

}  // namespace mimesis::walker
