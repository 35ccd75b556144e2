#include <gtest/gtest.h>

#include "common/math/circle.h"
#include "nodes/synthesizer/dynamics/character_batch.h"
#include "nodes/synthesizer/dynamics/posture.h"
#include "nodes/synthesizer/dynamics/testing/synthetic_model.h"

namespace mimesis::synthesizer {
namespace {

using testing::walking_model, testing::WalkSettings;

TEST(RootMotion, AWalkerMovesAtTheSpeedItWasMadeFor) {
  for (const double speed : {1.0, -0.6}) {
    const WalkSettings settings{.speed_m_s = speed};
    CharacterBatch batch(walking_model(settings), 1, {.dt_s = 1.0 / 100.0});
    for (int n = 0; n < 500; ++n) batch.step();
    const RootPose root = batch.root(0);
    EXPECT_NEAR(root.position_W_m.x(), 5.0 * speed, 0.05) << speed;
    EXPECT_NEAR(root.position_W_m.y(), 0.0, 0.02);
    EXPECT_NEAR(root.heading_rad, 0.0, 0.01);
    EXPECT_NEAR(root.height_m, 0.87, 0.005);
  }
}

TEST(RootMotion, ATurningWalkerTurns) {
  const WalkSettings settings{.speed_m_s = 0.8, .turn_rad_s = 0.5};
  CharacterBatch batch(walking_model(settings), 1, {.dt_s = 1.0 / 100.0});
  for (int n = 0; n < 400; ++n) batch.step();
  const RootPose root = batch.root(0);
  EXPECT_NEAR(root.heading_rad, 2.0, 0.02);
  const double radius = 0.8 / 0.5;  // on a circle to the left
  EXPECT_NEAR(root.position_W_m.x(), radius * std::sin(2.0), 0.05);
  EXPECT_NEAR(root.position_W_m.y(), radius * (1.0 - std::cos(2.0)), 0.05);
}

TEST(RootMotion, TheSupportingPointRestsInTheWorld) {  // for every motion of the figure
  CharacterBatch batch(testing::random_model(2), 1, {.dt_s = 1.0 / 200.0});
  batch.set_root(0, {2.0, 1.0}, 0.7);
  batch.set_frequency(0, 0.5);
  batch.step();
  int checked = 0, supports[2] = {0, 0}, changed = 0, was = 0;
  for (int n = 0; n < 8000; ++n) {
    const Eigen::Vector3d heel[2] = {batch.heel_W_m(0, 0), batch.heel_W_m(0, 1)};
    const Eigen::Vector3d toe[2] = {batch.toe_W_m(0, 0), batch.toe_W_m(0, 1)};
    batch.step();
    const int side = batch.root(0).support;
    const Eigen::Vector3d heel_now = batch.heel_W_m(0, side), toe_now = batch.toe_W_m(0, side);
    ++supports[side];
    if (side != was) changed = n;
    was = side;
    if (n < changed + 160) continue;                             // eased out after 0.8 s
    if (std::abs(heel_now.z() - toe_now.z()) < 0.021) continue;  // both carry
    const bool on_heel = heel_now.z() < toe_now.z();
    const Eigen::Vector3d moved = on_heel ? heel_now - heel[side] : toe_now - toe[side];
    ASSERT_LT(moved.head<2>().norm(), 2e-6) << n;
    ++checked;
  }
  EXPECT_GT(checked, 500);
  EXPECT_GT(std::min(supports[0], supports[1]), 100);
}

/// Largest change of a velocity from one step to the next, at 200 Hz.
struct Changes {
  double velocity_m_s = 0.0, yaw_rad_s = 0.0;  ///< velocities as moved
  double travelled_m = 0.0;
};
Changes changes(const motion::MotionModel& model) {
  CharacterBatch batch(model, 1, {.dt_s = 1.0 / 200.0});
  Changes most;
  RootPose before;
  for (int n = 0; n < 1400; ++n) {
    batch.step();
    const RootPose root = batch.root(0);
    if (n >= 400) {
      most.velocity_m_s =
          std::max(most.velocity_m_s, (root.velocity_H_m_s - before.velocity_H_m_s).norm());
      most.yaw_rad_s =
          std::max(most.yaw_rad_s, std::abs(root.yaw_rate_rad_s - before.yaw_rate_rad_s));
      most.travelled_m += root.velocity_H_m_s.x() / 200.0;
    }
    before = root;
  }
  return most;
}

TEST(RootMotion, VelocityDoesNotJumpWhereTheSupportChanges) {
  // the feet of this walker differ by 1/3 m/s, one ahead of the pelvis, one behind
  const Changes sliding = changes(walking_model({.slide_m = 0.1}));
  const Changes exact = changes(walking_model());
  EXPECT_LT(sliding.velocity_m_s, 0.15);
  EXPECT_NEAR(sliding.travelled_m, exact.travelled_m, 0.04);
}

}  // namespace
}  // namespace mimesis::synthesizer
