#include "common/kin/arm.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/kin/table.h"
#include "common/kin/test/arms.h"
#include "common/testing/no_malloc.h"

namespace mimesis::kin {
namespace {

TEST(Forward, PlanarArmMatchesItsClosedForm) {
  const ArmModel arm = planar_arm();
  for (const auto& [q1, q2] : {std::pair(0.0, 0.0), {0.3, -1.1}, {2.0, 0.7}, {-3.0, 1.5}}) {
    const Eigen::Isometry3d X_WE = end_effector(arm, Eigen::Vector2d(q1, q2));
    const Eigen::Vector3d expected(1.0 * std::cos(q1) + 0.8 * std::cos(q1 + q2),
                                   1.0 * std::sin(q1) + 0.8 * std::sin(q1 + q2), 0.0);
    EXPECT_LT((X_WE.translation() - expected).norm(), 1e-12);
    EXPECT_NEAR(std::atan2(X_WE.linear()(1, 0), X_WE.linear()(0, 0)),
                std::remainder(q1 + q2, 2 * M_PI), 1e-12);
  }
}

TEST(Forward, Lwr4StretchedUpHasAllLengthsInARow) {
  const Eigen::Isometry3d X_WE = end_effector(lwr4(), Eigen::VectorXd::Zero(7));
  EXPECT_LT((X_WE.translation() - Eigen::Vector3d(0, 0, 0.31 + 0.4 + 0.39 + 0.078 + 0.16)).norm(),
            1e-12);
  EXPECT_TRUE(X_WE.linear().isApprox(Eigen::Matrix3d::Identity(), 1e-12));
}

// q2 bends the shoulder by +90°: with α₁ = +90° a positive turn of joint 2 leans the arm to −x of
// W, and q1 turns the plane of the arm about z.
TEST(Forward, Lwr4BentShoulderPointsAwayInThePlaneOfJointOne) {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(7);
  q[1] = M_PI / 2;
  q[0] = 0.4;
  const double reach = 0.4 + 0.39 + 0.078 + 0.16;
  const Eigen::Vector3d expected(-reach * std::cos(0.4), -reach * std::sin(0.4), 0.31);
  EXPECT_LT((end_effector(lwr4(), q).translation() - expected).norm(), 1e-12);
}

// Joint 2 turns about −y of W at rest, joint 4 about +y: both quarter turns bend forwards.
TEST(Forward, Lwr4ShoulderAndElbowBendForwards) {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(7);
  q[1] = -M_PI / 2;
  q[3] = M_PI / 2;
  const Eigen::Vector3d elbow(0.4, 0, 0.31);
  std::vector<Eigen::Isometry3d> X;
  forward(lwr4(), q, X);
  ASSERT_EQ(X.size(), 8u);
  EXPECT_LT((X[4].translation() - elbow).norm(), 1e-12);
  EXPECT_LT((X[5].translation() - elbow - Eigen::Vector3d(0, 0, -0.39)).norm(), 1e-12);
}

/// One after the other, as the convention is written; and the parts around the joint.
TEST(Forward, ModifiedLinksTurnBeforeTheyMove) {
  using Eigen::AngleAxisd, Eigen::Translation3d, Eigen::Vector3d;
  ArmModel arm;
  arm.links = {{.a = 0.1, .alpha = 0.7, .d = 0.3, .offset = 0.2, .modified = true},
               {.a = -0.2, .alpha = -1.1, .d = 0.4, .offset = -0.5, .modified = true}};
  const Eigen::Vector2d q(0.9, -0.4);
  Eigen::Isometry3d expected = Eigen::Isometry3d::Identity(), parts = expected;
  for (int i = 0; i < 2; ++i) {
    const DhLink& link = arm.links[static_cast<std::size_t>(i)];
    const AngleAxisd turn(q[i] + link.offset, Vector3d::UnitZ());
    expected = expected * AngleAxisd(link.alpha, Vector3d::UnitX()) * Translation3d(link.a, 0, 0) *
               turn * Translation3d(0, 0, link.d);
    parts = parts * link.before_joint() * turn * link.after_joint();
  }
  EXPECT_TRUE(end_effector(arm, q).isApprox(expected, 1e-12));
  EXPECT_TRUE(parts.isApprox(expected, 1e-12));
  const auto J = jacobian(arm, q);
  for (int i = 0; i < 2; ++i) {
    constexpr double kH = 1e-6;
    const Vector3d moved = (end_effector(arm, q + kH * Eigen::Vector2d::Unit(i)).translation() -
                            end_effector(arm, q - kH * Eigen::Vector2d::Unit(i)).translation()) /
                           (2 * kH);
    EXPECT_LT((J.col(i).head<3>() - moved).norm(), 1e-8);
  }
}

TEST(Forward, JointsThatSlideMoveAlongTheirAxis) {
  using namespace Eigen;
  for (const bool modified : {false, true}) {
    ArmModel arm;
    arm.links = {
        {.a = 0.3, .alpha = 0.4, .d = 0.1, .offset = 0.7, .modified = modified, .slides = true}};
    const AngleAxisd turn(0.7, Vector3d::UnitZ()), tilt(0.4, Vector3d::UnitX());
    const Translation3d along_z(0.0, 0.0, 0.1 + 0.25), along_x(0.3, 0.0, 0.0);
    const Isometry3d expected =
        modified ? tilt * along_x * turn * along_z : turn * along_z * along_x * tilt;
    EXPECT_TRUE(end_effector(arm, VectorXd::Constant(1, 0.25)).isApprox(expected, 1e-14));
    const DhLink& link = arm.links[0];
    EXPECT_TRUE((link.before_joint() * Translation3d(0.0, 0.0, 0.25) * link.after_joint())
                    .isApprox(expected, 1e-14));
  }
}

TEST(Forward, BaseAndToolPosesCompose) {
  ArmModel arm = planar_arm();
  arm.X_WB =
      Eigen::Translation3d(0.1, -0.2, 0.3) * Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ());
  arm.X_LE.translation() << 0.5, 0, 0;
  const Eigen::Vector3d p = end_effector(arm, Eigen::Vector2d::Zero()).translation();
  EXPECT_LT((p - Eigen::Vector3d(0.1, -0.2 + 1.0 + 0.8 + 0.5, 0.3)).norm(), 1e-12);
}

TEST(Jacobian, EqualsCentralDifferences) {
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> angle(-2.0, 2.0);
  constexpr double kH = 1e-6;
  for (int trial = 0; trial < 60; ++trial) {
    ArmModel arm = lwr4();
    for (std::size_t j = 0; j < 7; ++j) {  // the first 20 as they are, then some that slide
      arm.links[j].modified = trial >= 40;
      arm.links[j].slides = trial >= 20 && generator() % 3 == 0;
      arm.links[j].offset = 0.1 * static_cast<double>(j);
    }
    Eigen::VectorXd q(7);
    for (double& x : q) x = angle(generator);
    const auto J = jacobian(arm, q);
    for (int j = 0; j < 7; ++j) {
      Eigen::VectorXd plus = q, minus = q;
      plus[j] += kH;
      minus[j] -= kH;
      const Eigen::Isometry3d a = end_effector(arm, minus), b = end_effector(arm, plus);
      const Eigen::Vector3d linear = (b.translation() - a.translation()) / (2 * kH);
      const Eigen::AngleAxisd turn(Eigen::Matrix3d(b.linear() * a.linear().transpose()));
      const Eigen::Vector3d angular = turn.axis() * turn.angle() / (2 * kH);
      EXPECT_LT((J.col(j).head<3>() - linear).norm(), 1e-8) << "joint " << j;
      EXPECT_LT((J.col(j).tail<3>() - angular).norm(), 1e-6) << "joint " << j;
    }
  }
}

TEST(BallCenters, FollowTheirFrames) {
  ArmModel arm = planar_arm();
  arm.balls = {{.frame = 0, .center = {0.1, 0.2, 0.3}, .radius = 0.1},
               {.frame = 2, .center = {-0.4, 0.0, 0.0}, .radius = 0.1}};
  std::vector<Eigen::Isometry3d> X;
  forward(arm, Eigen::Vector2d(M_PI / 2, -M_PI / 2), X);
  Eigen::Matrix3Xd centers;
  ball_centers(arm, X, centers);
  EXPECT_LT((centers.col(0) - Eigen::Vector3d(0.1, 0.2, 0.3)).norm(), 1e-12);
  EXPECT_LT((centers.col(1) - Eigen::Vector3d(0.4, 1.0, 0.0)).norm(),
            1e-12);  // halfway along link 2
}

TEST(Forward, DoesNotAllocateOnceSized) {
  const ArmModel arm = lwr4();
  const Eigen::VectorXd q = Eigen::VectorXd::Constant(7, 0.3);
  std::vector<Eigen::Isometry3d> X;
  Eigen::Matrix3Xd centers;
  forward(arm, q, X);
  ball_centers(arm, X, centers);
  testing::NoMalloc guard;
  forward(arm, q, X);
  ball_centers(arm, X, centers);
}

const BarShape kBar{.x = 0.52,
                    .surface_z = -0.01,
                    .half_width = 0.34,
                    .height = 0.375,
                    .ball_radius = 0.035,
                    .max_spacing = 0.045};

TEST(Bar, LeavesExactlyItsHeightBelowTheBar) {
  double lowest = INFINITY;
  for (const Ball& ball : bar_balls(kBar)) {
    if (std::abs(ball.center.y()) < 0.3) lowest = std::min(lowest, ball.center.z() - ball.radius);
  }
  EXPECT_NEAR(lowest - kBar.surface_z, kBar.height, 1e-12);
  EXPECT_NEAR(bar_center(kBar).z(), 0.40, 1e-12);
}

TEST(Bar, PostsStandOnTheTableAndReachTheBar) {
  double lowest = INFINITY, highest = -INFINITY;
  for (const Ball& ball : bar_balls(kBar)) {
    lowest = std::min(lowest, ball.center.z() - ball.radius);
    highest = std::max(highest, ball.center.z());
    EXPECT_DOUBLE_EQ(ball.center.x(), 0.52);
    EXPECT_LE(std::abs(ball.center.y()), 0.34 + 1e-12);
  }
  EXPECT_NEAR(lowest, kBar.surface_z, 1e-12);
  EXPECT_NEAR(highest, 0.40, 1e-12);
}

TEST(Bar, HasNoGapAlongTheBarAndNoBallTwice) {
  const std::vector<Ball> balls = bar_balls(kBar);
  for (double y = -0.34; y <= 0.34; y += 0.005) {
    double nearest = INFINITY;
    for (const Ball& ball : balls) {
      nearest = std::min(nearest, (ball.center - Eigen::Vector3d(0.52, y, 0.40)).norm());
    }
    EXPECT_LE(nearest, kBar.max_spacing / 2 + 1e-12) << "y = " << y;
  }
  for (std::size_t i = 0; i < balls.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_GT((balls[i].center - balls[j].center).norm(), 0.03) << i << " and " << j;
    }
  }
}

}  // namespace
}  // namespace mimesis::kin
