#include "nodes/walker/stabilizer/estimator.h"

#include <gtest/gtest.h>

#include "common/math/so3.h"
#include "nodes/walker/stabilizer/leaky.h"
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
}  // namespace mimesis::walker
