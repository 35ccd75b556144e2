#include "experiments/walk/trial/capture.h"

#include <gtest/gtest.h>

#include "experiments/walk/trial/trial.h"

namespace mimesis::walk {
namespace {

using Eigen::Vector2d;
using walker::kLeft, walker::kRight;

/// biped.urdf on its left foot at the origin, the right one swings for another 0.4 s.
class CaptureTest : public ::testing::Test {
 protected:
  CaptureTest() {
    plan_.contact = {true, false};
    plan_.foot[kRight].X_WS.translation().y() = -0.19;
    plan_.swing = kRight;
    plan_.to_landing_s = 0.4;
  }
  Capturability at(double x, double y) const {
    return capturability(robot_.biped, gait_, plan_, Vector2d(x, y), kOmega_1_s);
  }
  static constexpr double kOmega_1_s = 3.5;
  const Robot robot_ = load_robot("biped");
  const walker::GaitSettings gait_ = walker::gait_settings(robot_.biped);
  walker::PatternSample plan_;
};

TEST_F(CaptureTest, HoldsWhatIsAboveTheSole) {
  EXPECT_TRUE(at(0.12, 0.07).capturable);
  EXPECT_EQ(at(0.12, 0.07).beyond_m, 0.0);
}

TEST_F(CaptureTest, AStepCapturesOnTheSideOfTheSwingAlone) {
  const double grows = std::exp(kOmega_1_s * 0.4), inner = 0.056, outer = 0.075;
  // by eq. 1.3, to the outer edge of a right foot at its widest
  const double most = inner + (gait_.widest_step_m + outer - inner) / grows;
  EXPECT_TRUE(at(0.0, -most + 1e-6).capturable);
  EXPECT_FALSE(at(0.0, -most - 1e-6).capturable);
  EXPECT_NEAR(at(0.0, -most - 1e-3).beyond_m, 1e-3 * grows, 1e-9);
  EXPECT_FALSE(at(0.0, outer + 1e-3).capturable) << "beyond the standing foot it cannot step";
  const double front = 0.13;
  EXPECT_FALSE(at(front + (gait_.longest_step_m + front - front) / grows + 1e-6, -0.1).capturable);
}

TEST_F(CaptureTest, BothFeetHoldWhatIsBetweenThem) {
  plan_.contact = {true, true};
  EXPECT_TRUE(at(0.0, -0.19).capturable);
  EXPECT_FALSE(at(0.0, -0.28).capturable);
  EXPECT_NEAR(at(0.0, -0.28).beyond_m, 0.28 - 0.19 - 0.075, 1e-9);
}

}  // namespace
}  // namespace mimesis::walk
