#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/kin/arm.h"
#include "common/kin/test/arms.h"

namespace mimesis::kin {
namespace {

double angle(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::min(1.0, a.dot(b)));
}

TEST(Ik, PlanarArmFindsOneOfItsTwoElbows) {
  const ArmModel arm = planar_arm();
  const Eigen::Vector3d goal(0.9, 0.6, 0.0);
  const double c2 = (goal.squaredNorm() - 1.0 - 0.64) / (2 * 0.8);  // law of cosines
  const auto up = solve_ik(arm, {.position_in_W = goal, .axes = {}}, Eigen::Vector2d(1.0, -1.0));
  const auto down = solve_ik(arm, {.position_in_W = goal, .axes = {}}, Eigen::Vector2d(0.0, 1.0));
  ASSERT_TRUE(up && down);
  EXPECT_NEAR((*up)[1], -std::acos(c2), 1e-4);
  EXPECT_NEAR((*down)[1], std::acos(c2), 1e-4);
}

TEST(Ik, RefusesWhatIsOutOfReachOrOutsideTheLimits) {
  ArmModel arm = planar_arm();
  EXPECT_FALSE(
      solve_ik(arm, {.position_in_W = {1.9, 0, 0}, .axes = {}}, Eigen::Vector2d(0.1, 0.1)));
  arm.q_min << 0.5, 0.1;  // the arm can only bend to the left
  arm.q_max << 1.0, 2.0;
  EXPECT_FALSE(
      solve_ik(arm, {.position_in_W = {0.9, -0.6, 0}, .axes = {}}, Eigen::Vector2d(0.7, 0.5)));
}

TEST(Ik, Lwr4PointsItsToolDownWithinTheLimits) {
  const ArmModel arm = lwr4();
  const IkGoal goal{.position_in_W = {0.45, 0.1, 0.2}, .axes = {{}}};
  const auto solutions = solve_ik_anywhere(arm, goal, 30, 1);
  EXPECT_GE(solutions.size(), 10u);
  for (const Eigen::VectorXd& q : solutions) {
    const Eigen::Isometry3d X_WE = end_effector(arm, q);
    EXPECT_LT((X_WE.translation() - goal.position_in_W).norm(), 1e-5);
    EXPECT_LT(angle(X_WE.linear().col(2), -Eigen::Vector3d::UnitZ()), 1e-3);
    EXPECT_TRUE((q.array() >= arm.q_min.array() + 0.01 - 1e-12).all());
    EXPECT_TRUE((q.array() <= arm.q_max.array() - 0.01 + 1e-12).all());
  }
}

TEST(Ik, TwoAxesFixTheOrientation) {
  const ArmModel arm = lwr4();
  const Eigen::Vector3d forward_and_left = Eigen::Vector3d(1, 1, 0).normalized();
  const IkGoal goal{.position_in_W = {0.6, 0.3, 0.3},
                    .axes = {{Eigen::Vector3d::UnitZ(), forward_and_left},
                             {Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()}}};
  const auto solutions = solve_ik_anywhere(arm, goal, 30, 2);
  ASSERT_GE(solutions.size(), 3u);
  for (const Eigen::VectorXd& q : solutions) {
    const Eigen::Matrix3d R_WE = end_effector(arm, q).linear();
    EXPECT_LT(angle(R_WE.col(2), forward_and_left), 1e-3);
    EXPECT_LT(angle(R_WE.col(1), Eigen::Vector3d::UnitZ()), 1e-3);
  }
}

// A posture's own pose is reached again from nearby: what straight-line motions rely on.
TEST(Ik, ReturnsToReachablePosesFromNearby) {
  const ArmModel arm = lwr4();
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> wide(-1.8, 1.8), near(-0.05, 0.05);
  for (int trial = 0; trial < 50; ++trial) {
    Eigen::VectorXd q(7), start(7);
    for (int j = 0; j < 7; ++j) start[j] = (q[j] = wide(generator)) + near(generator);
    const Eigen::Isometry3d X_WE = end_effector(arm, q);
    const IkGoal goal{.position_in_W = X_WE.translation(),
                      .axes = {{Eigen::Vector3d::UnitZ(), X_WE.linear().col(2)},
                               {Eigen::Vector3d::UnitX(), X_WE.linear().col(0)}}};
    const auto solution = solve_ik(arm, goal, start);
    ASSERT_TRUE(solution) << "trial " << trial;
    EXPECT_LT((*solution - q).norm(), 0.5) << "trial " << trial;
  }
}

TEST(Ik, TurnsAnOppositeAxisAround) {
  const ArmModel arm = lwr4();
  Eigen::VectorXd q(7);
  q << 0.0, -0.5, 0.0, 1.2, 0.0, -0.6, 0.0;
  const Eigen::Isometry3d X_WE = end_effector(arm, q);
  const IkGoal goal{.position_in_W = X_WE.translation(),
                    .axes = {{Eigen::Vector3d::UnitX(), -X_WE.linear().col(0)}}};
  const auto turned = solve_ik(arm, goal, q);
  ASSERT_TRUE(turned);
  EXPECT_LT(angle(end_effector(arm, *turned).linear().col(0), -X_WE.linear().col(0)), 1e-3);
}

TEST(Ik, IsRepeatable) {
  const ArmModel arm = lwr4();
  const IkGoal goal{.position_in_W = {0.45, 0.1, 0.2}, .axes = {{}}};
  const auto a = solve_ik_anywhere(arm, goal, 10, 5), b = solve_ik_anywhere(arm, goal, 10, 5);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i], b[i]);
}

}  // namespace
}  // namespace mimesis::kin
