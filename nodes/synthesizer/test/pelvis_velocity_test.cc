#include <gtest/gtest.h>

#include <cmath>

#include "nodes/synthesizer/character/characters.h"

namespace mimesis::synthesizer {
namespace {

TEST(PelvisVelocity, IsTheStepResponseOfACriticallyDampedLowPass) {
  constexpr double kDt = 1.0 / 200.0, kLambda = 20.0;
  PelvisVelocity smooth(kDt);
  RootPose root;
  root.velocity_H_m_s = {1.0, -0.5};
  root.yaw_rate_rad_s = 0.3;
  for (int n = 1; n <= 200; ++n) {
    smooth.step(root);
    const double t = n * kDt, rise = 1.0 - (1.0 + kLambda * t) * std::exp(-kLambda * t);
    EXPECT_LT((smooth.value() - rise * Eigen::Vector3d(1.0, -0.5, 0.3)).norm(), 1e-12) << t;
  }
}

TEST(PelvisVelocity, FollowsARampATenthOfASecondBehind) {
  PelvisVelocity smooth(1.0 / 200.0);
  RootPose root;
  for (int n = 1; n <= 400; ++n) {
    root.velocity_H_m_s.x() = 0.01 * n;  // 2 m/s²
    smooth.step(root);
  }
  EXPECT_NEAR(smooth.value().x(), 4.0 - 2.0 * 0.1, 0.006);  // held for a step: half a step more
}

}  // namespace
}  // namespace mimesis::synthesizer
