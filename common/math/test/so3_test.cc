#include "common/math/so3.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <numbers>
#include <random>

#include "common/math/circle.h"

namespace mimesis::math {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;

TEST(So3, ExponentialTurnsByTheRightHand) {
  EXPECT_LT((exp_so3({0, 0, kPi / 2}) * Vector3d::UnitX() - Vector3d::UnitY()).norm(), 1e-15);
  const Vector3d w(0.3, -1.1, 0.7);
  EXPECT_LT((exp_so3(w) - Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix()).norm(),
            1e-14);
}

TEST(So3, LogarithmInvertsAtAllAngles) {
  const Vector3d axis = Vector3d(1, 2, -3).normalized();
  for (const double theta : {0.0, 1e-12, 1e-7, 1e-5, 0.1, 1.0, 3.0, kPi - 1e-7}) {
    EXPECT_LT((log_so3(exp_so3(theta * axis)) - theta * axis).norm(), 1e-9) << theta;
  }
  EXPECT_LT((exp_so3(log_so3(exp_so3(kPi * axis))) - exp_so3(kPi * axis)).norm(), 1e-9);
}

TEST(So3, RotationOntoIsTheShortestTurn) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 1000; ++i) {
    const Vector3d from(normal(random), normal(random), normal(random));
    Vector3d to(normal(random), normal(random), normal(random));
    if (i % 4 == 0) to = -2.0 * from;
    if (i % 4 == 1) to = -from + 1e-7 * to;
    const Matrix3d R = rotation_onto(from, to);
    // Within 1.5e-6 rad of a half turn it is a half turn.
    EXPECT_LT((R * from.normalized() - to.normalized()).norm(), i % 4 == 1 ? 2e-6 : 1e-12) << i;
    EXPECT_LT((R * R.transpose() - Matrix3d::Identity()).norm(), 1e-12) << i;
    EXPECT_GT(R.determinant(), 0.0) << i;
    // The angle of the turn is that between the vectors: trace R = 1 + 2 cos θ.
    EXPECT_NEAR(R.trace(), 1.0 + 2.0 * from.normalized().dot(to.normalized()), 1e-9) << i;
  }
}

TEST(So3, NearestAxisAngleFollowsATurnBeyondPi) {
  Vector3d last = Vector3d::Zero();
  for (double theta = 0.0; theta < 9.0; theta += 0.1) {
    const Vector3d full = theta * Vector3d(0, 0.6, 0.8);
    last = nearest_axis_angle(log_so3(exp_so3(full)), last);
    EXPECT_LT((last - full).norm(), 1e-9) << theta;
  }
}

TEST(Circle, WrapsIntoItsRanges) {
  EXPECT_NEAR(wrap_pi(3.5 * kPi), -0.5 * kPi, 1e-14);
  EXPECT_NEAR(wrap_two_pi(-0.5 * kPi), 1.5 * kPi, 1e-14);
  EXPECT_EQ(wrap_two_pi(-1e-20), 0.0);
}

}  // namespace
}  // namespace mimesis::math
