#include "nodes/walker/filter/whole_body.h"

#include <gtest/gtest.h>

#include "common/robot/test/test_bipeds.h"
#include "nodes/walker/filter/test/plain_walk.h"
#include "nodes/walker/pattern/generators.h"
#include "nodes/walker/testing/filtered_walk.h"

namespace mimesis::walker {
namespace {

using Eigen::Matrix3Xd, Eigen::Vector3d, Eigen::VectorXd;

UpperBody at_rest(const robot::Biped& biped) {
  const VectorXd zero = VectorXd::Zero(static_cast<Eigen::Index>(biped.upper_body.size()));
  return {.q = biped.half_sitting(biped.upper_body), .dq = zero, .ddq = zero};
}

std::vector<robot::Biped> robots() {
  std::vector<robot::Biped> all{robot::hrp2_like()};
  if (auto other = robot::jvrc1()) all.push_back(std::move(*other));
  return all;
}

TEST(WholeBody, WalksAsPlanned) {
  for (const robot::Biped& biped : robots()) {
    const GaitSettings gait = gait_settings(biped);
    LinearMpc pattern(gait);
    pattern.reset(stance(biped));
    WholeBody body(biped, gait.com_height_m);
    robot::Dynamics dynamics(biped.tree);
    robot::Kinematics kinematics(biped.tree);
    Matrix3Xd J(3, 6 + biped.tree.dof());
    robot::Jacobian J_foot(6, 6 + biped.tree.dof());
    UpperBody upper = at_rest(biped);
    VectorXd nu(6 + biped.tree.dof());
    bool turned = false;
    for (int tick = 0; tick < 1000; ++tick) {
      pattern.step(wish(0.2, 0.02, 0.1));
      if (tick % 37 != 0) continue;
      for (Eigen::Index i = 0; i < upper.q.size(); ++i) {  // something that moves
        upper.dq[i] = 0.3 * std::cos(0.1 * tick + static_cast<double>(i));
        upper.ddq[i] = 2.0 * std::sin(0.1 * tick + static_cast<double>(i));
      }
      const PatternSample& now = pattern.now();
      const robot::RobotMotion& m = body.motion(now, now.com, upper, body.moments(upper));
      ASSERT_FALSE(body.unreachable()) << biped.tree.name() << ' ' << tick;
      kinematics.update(m.X_WB, m.q);
      dynamics.com_jacobian(kinematics, J);
      nu << m.v_W, m.omega_W, m.dq;
      const Vector3d com(now.com.p_W_m.x(), now.com.p_W_m.y(), gait.com_height_m);
      const Vector3d v(now.com.v_W.x(), now.com.v_W.y(), 0.0);
      const Vector3d a(now.com.a_W.x(), now.com.a_W.y(), robot::kGravity);
      EXPECT_LT((kinematics.com() - com).norm(), 2e-4);
      EXPECT_LT((J * nu - v).norm(), 2e-3);
      const Vector3d force = dynamics.ground_wrench(m).force / biped.tree.mass_kg();
      EXPECT_LT((force - a).norm(), 0.05) << biped.tree.name() << ' ' << tick;
      EXPECT_NEAR(m.X_WB.linear()(0, 0), std::cos(now.yaw_rad), 1e-12);
      EXPECT_EQ(m.omega_W, Vector3d(0, 0, now.yaw_rate_rad_s));
      const double turns = now.foot[kLeft].yaw_acceleration + now.foot[kRight].yaw_acceleration;
      EXPECT_NEAR(m.alpha_W.z(), 0.5 * turns, 1e-12);  // the waist's yaw is the feet's mean
      turned = turned || std::abs(turns) > 0.01;
      for (const Side side : robot::kSides) {
        const FootState& foot = now.foot[side];
        const auto& X_WS = kinematics.X_WL(biped.leg[side].sole);
        EXPECT_LT((X_WS.matrix() - foot.X_WS.matrix()).cwiseAbs().maxCoeff(), 1e-9);
        kinematics.jacobian(biped.leg[side].sole, X_WS.translation(), J_foot);
        const Eigen::Matrix<double, 6, 1> rate = J_foot * nu;
        EXPECT_LT((rate.head<3>() - foot.v_W).norm(), 1e-4);
        EXPECT_LT((rate.tail<3>() - Vector3d(0, 0, foot.yaw_rate_rad_s)).norm(), 1e-4);
      }
    }
    EXPECT_TRUE(turned);
  }
}

TEST(WholeBody, LegsReachTheLongestStepsOfTheDrawerTask) {
  const robot::Biped biped = robot::hrp2_like();
  GaitSettings gait = gait_settings(biped);
  gait.com_height_m = 0.807;  // height of models/biped.yaml
  LinearMpc pattern(gait);
  pattern.reset(stance(biped));
  WholeBody body(biped, gait.com_height_m);
  const UpperBody upper = at_rest(biped);
  const WholeBody::Moments moments = body.moments(upper);
  constexpr double kLength_m = 0.2805;
  double longest_m = 0.0, straightest_rad = 10.0;
  for (int tick = 0; tick < 160 * 10; ++tick) {
    pattern.step(wish(kLength_m / gait.step_s));
    const PatternSample& now = pattern.now();
    const robot::RobotMotion& m = body.motion(now, now.com, upper, moments);
    ASSERT_FALSE(body.unreachable()) << tick;
    const Vector3d between =
        now.foot[kLeft].X_WS.translation() - now.foot[kRight].X_WS.translation();
    if (now.contact[kLeft] && now.contact[kRight]) {
      longest_m = std::max(longest_m, std::abs(between.x()));
    }
    for (const Side side : robot::kSides) {
      straightest_rad = std::min(straightest_rad, m.q[biped.leg[side].dof[3]]);
    }
  }
  EXPECT_NEAR(longest_m, kLength_m, 0.005);
  EXPECT_GT(straightest_rad, 0.1);  // LegIk stretches at 0.01, the stack at 0.02
}

TEST(WholeBody, FromTheLastTicksLeverItFindsTheSameMotion) {
  const robot::Biped biped = robot::hrp2_like();
  const GaitSettings gait = gait_settings(biped);
  LinearMpc pattern(gait);
  pattern.reset(stance(biped));
  WholeBody body(biped, gait.com_height_m);
  const SwingingArms arms(biped, 1.0);
  UpperBody upper;
  WholeBody::Lever lever;
  double squares = 0.0;
  for (int tick = 0; tick < 1200; ++tick) {
    pattern.step(wish(0.3, 0.0, 0.05));
    arms.at(tick * kTick_s, upper);
    const PatternSample& now = pattern.now();
    const WholeBody::Moments moments = body.moments(upper);
    const Eigen::Vector2d anew = body.zmp(now, now.com, upper, moments),
                          on = body.zmp(now, now.com, upper, moments, &lever);
    EXPECT_LT((anew - on).norm(), 3e-3) << tick;
    squares += (anew - on).squaredNorm();
  }
  EXPECT_LT(std::sqrt(squares / 1200.0), 2e-4);
}

TEST(WholeBody, StandingZmpIsBelowTheCom) {
  const robot::Biped biped = robot::hrp2_like();
  const GaitSettings gait = gait_settings(biped);
  LinearMpc pattern(gait);
  pattern.reset(stance(biped));
  WholeBody body(biped, gait.com_height_m);
  const UpperBody upper = at_rest(biped);
  ComState com = pattern.now().com;
  com.p_W_m.x() += 0.03;
  const Eigen::Vector2d zmp = body.zmp(pattern.now(), com, upper, body.moments(upper));
  EXPECT_LT((zmp - com.p_W_m).norm(), 1e-4);
}

TEST(WholeBody, ALegTooShortIsSaidAndGivesNumbers) {
  const robot::Biped biped = robot::hrp2_like();
  LinearMpc pattern(gait_settings(biped));
  pattern.reset(stance(biped));
  WholeBody body(biped, 1.2);
  const UpperBody upper = at_rest(biped);
  const Eigen::Vector2d zmp =
      body.zmp(pattern.now(), pattern.now().com, upper, body.moments(upper));
  EXPECT_TRUE(body.unreachable());
  EXPECT_TRUE(zmp.allFinite());
}

/// A walk too tall for its steps: legs get straight, are too short, and come back.
TEST(WholeBody, AlmostStraightAndTooShortLegsLeaveAnOrdinaryZmp) {
  const robot::Biped biped = robot::hrp2_like();
  for (const double height_m : {0.825, 0.84, 0.86}) {
    GaitSettings gait = gait_settings(biped);
    gait.com_height_m = height_m;
    LinearMpc pattern(gait);
    pattern.reset(stance(biped));
    WholeBody body(biped, height_m);
    robot::Dynamics dynamics(biped.tree);
    const UpperBody upper = at_rest(biped);
    const WholeBody::Moments moments = body.moments(upper);
    WholeBody::Lever lever;
    int short_of_it = 0;
    for (int tick = 0; tick < 1200; ++tick) {
      pattern.step(wish(0.33));
      const PatternSample& now = pattern.now();
      for (WholeBody::Lever* from : {static_cast<WholeBody::Lever*>(nullptr), &lever}) {
        const Eigen::Vector2d zmp = body.zmp(now, now.com, upper, moments, from);
        EXPECT_LT((zmp - now.zmp_W_m).norm(), 0.3) << height_m << ' ' << tick;
        const bool guessed = from != nullptr && body.unreachable();
        EXPECT_FALSE(guessed && lever.known) << tick;
      }
      const robot::RobotMotion& m = body.motion(now, now.com, upper, moments, nullptr);
      EXPECT_LT(m.ddq.cwiseAbs().maxCoeff(), 800.0) << height_m << ' ' << tick;
      const double lift = dynamics.ground_wrench(m).force.z() / biped.tree.mass_kg();
      EXPECT_NEAR(lift, robot::kGravity, 0.25 * robot::kGravity) << height_m << ' ' << tick;
      short_of_it += body.unreachable();
    }
    EXPECT_GT(short_of_it, 50) << height_m;
  }
}

TEST(WholeBody, GroundCarriesTheWeightWhateverTheArmsDo) {
  const robot::Biped biped = robot::hrp2_like();
  const GaitSettings gait = gait_settings(biped);
  LinearMpc pattern(gait);
  pattern.reset(stance(biped));
  WholeBody body(biped, gait.com_height_m);
  UpperBody upper = at_rest(biped);
  const auto zmp_with = [&](double acceleration) {
    upper.ddq.setConstant(acceleration);
    return body.zmp(pattern.now(), pattern.now().com, upper, body.moments(upper));
  };
  // m (c × (c̈ + g)) is the plan's, the rest grows with the motion of the arms
  const Eigen::Vector2d rest = zmp_with(0.0), little = zmp_with(1.0), much = zmp_with(400.0);
  EXPECT_GT((little - rest).norm(), 1e-4);
  EXPECT_LT((much - rest - 400.0 * (little - rest)).norm(), 0.1 * (much - rest).norm());
}

}  // namespace
}  // namespace mimesis::walker
