#include <gtest/gtest.h>

#include "hw/sim/body/body_world.h"
#include "hw/sim/body/test/bodies.h"

namespace mimesis::hw::sim {
namespace {

using Eigen::Vector3d;

class BodySensorsTest : public testing::Test {
 protected:
  void step(BodyWorld& world, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      world.step({target_.data(), static_cast<std::size_t>(target_.size())}, kTick_s);
    }
  }
  void turn(const std::string& joint, double by_rad) {
    target_[robot_.biped.tree.require_joint(joint)] += by_rad;
  }

  const TestRobot robot_ = test_robot();
  Eigen::VectorXd target_ = robot_.biped.half_sitting;
};

/// Both feet: the wrench about each sole puts the pressure where the truth says it is.
Eigen::Vector2d pressure(const BodyWorld& world) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double normal = 0.0;
  for (const robot::Side side : robot::kSides) {
    const robot::Wrench& wrench = world.sensors().foot_S[side];
    const Vector3d at(-wrench.moment.y(), wrench.moment.x(), 0.0);  // times f_z
    sum += (world.truth().X_WS[side].linear() * at +
            wrench.force.z() * world.truth().X_WS[side].translation())
               .head<2>();
    normal += wrench.force.z();
  }
  return sum / normal;
}

TEST_F(BodySensorsTest, LeaningForwardPressesTheToes) {
  BodyWorld world(robot_.biped, robot_.urdf, {});
  turn("left_ankle_pitch", -0.04);  // the shanks tilt forward
  turn("right_ankle_pitch", -0.04);
  // in half a second, as a jump would throw it
  const Eigen::VectorXd goal = target_;
  for (int i = 1; i <= 100; ++i) {
    target_ = robot_.biped.half_sitting + i / 100.0 * (goal - robot_.biped.half_sitting);
    step(world, 1);
  }
  step(world, 200);
  ASSERT_FALSE(world.truth().fell);
  EXPECT_GT(world.truth().com_W_m.x(), 0.03);
  EXPECT_LT(world.sensors().foot_S[0].moment.y(), -5.0);
  EXPECT_LT(world.truth().ankle_pitch_n_m[0], -5.0);
  EXPECT_LT((pressure(world) - world.truth().zmp_W_m).norm(), 5e-4);
  // the motor holds against the ground; between them only the foot's weight
  EXPECT_NEAR(world.sensors().torque[robot_.biped.leg[0].dof[4]], -world.truth().ankle_pitch_n_m[0],
              0.5);
}

TEST_F(BodySensorsTest, LeaningLeftLoadsTheLeftFoot) {
  BodyWorld world(robot_.biped, robot_.urdf, {});
  for (int i = 0; i < 40; ++i) {
    for (const char* joint : {"left_hip_roll", "right_hip_roll"}) turn(joint, -0.001);
    for (const char* joint : {"left_ankle_roll", "right_ankle_roll"}) turn(joint, 0.001);
    step(world, 4);
  }
  step(world, 200);
  ASSERT_FALSE(world.truth().fell);
  EXPECT_GT(world.truth().com_W_m.y(), 0.01);
  EXPECT_GT(world.truth().normal_n[0], world.truth().normal_n[1] + 50.0);
  EXPECT_LT((pressure(world) - world.truth().zmp_W_m).norm(), 5e-4);
}

/// Impulses of ground, gravity and a push add up to the momentum gained.
TEST_F(BodySensorsTest, FootForcesAreMeansOfTheTick) {
  BodyWorld world(robot_.biped, robot_.urdf, {});
  step(world, 100);
  const double mass = robot_.biped.tree.mass_kg();
  const Vector3d before = mass * world.truth().com_v_W;
  world.push({.at_s = 0.5, .duration_s = 0.1, .impulse_W_ns = {4.0, 3.0, 0.0}});
  Vector3d impulse(4.0, 3.0, -0.2 * robot_.weight_n());
  for (int i = 0; i < 40; ++i) {
    step(world, 1);
    for (const robot::Side side : robot::kSides) {
      impulse += kTick_s * world.truth().X_WS[side].linear() * world.sensors().foot_S[side].force;
    }
  }
  EXPECT_LT((mass * world.truth().com_v_W - before - impulse).norm(), 0.02);
}

TEST_F(BodySensorsTest, NothingIsFeltInFreeFall) {
  BodyWorld world(robot_.biped, robot_.urdf, {});
  EXPECT_NEAR(world.sensors().specific_force_I.z(), robot::kGravity, 1e-12);
  step(world, 200);
  EXPECT_NEAR(world.sensors().specific_force_I.z(), robot::kGravity, 0.02);
  const Vector3d lift(0.0, 0.0, 1.5 * robot_.weight_n());
  world.pull(0, robot_.biped.tree.link(0).inertia.com_m, lift);
  step(world, 100);
  world.pull(0, Vector3d::Zero(), Vector3d::Zero());
  step(world, 10);
  const Vector3d v = world.truth().com_v_W;
  Vector3d felt = Vector3d::Zero();
  for (int i = 0; i < 40; ++i) {  // the springs, let go, shake it
    step(world, 1);
    felt += world.sensors().specific_force_I / 40.0;
  }
  EXPECT_EQ(world.sensors().foot_S[0].force.norm() + world.sensors().foot_S[1].force.norm(), 0.0);
  EXPECT_LT((world.truth().com_v_W - v - Vector3d(0.0, 0.0, -0.2 * robot::kGravity)).norm(), 1e-3);
  EXPECT_LT(felt.norm(), 0.05 * robot::kGravity);
}

/// Against the second difference of where the pelvis is, in the midst of a fall.
TEST_F(BodySensorsTest, SpecificForceIsAccelerationLessGravity) {
  BodyWorld world(robot_.biped, robot_.urdf, {});
  world.push({.impulse_W_ns = {30.0, 20.0, 0.0}});
  step(world, 120);
  std::array<Vector3d, 4> p;
  Vector3d felt_W = Vector3d::Zero();
  for (std::size_t i = 0; i < p.size(); ++i) {
    p[i] = world.truth().X_WB.translation();
    step(world, 1);
    if (i == 1) felt_W = world.sensors().R_WI * world.sensors().specific_force_I;
  }
  const Vector3d a_W = (p[3] - p[2] - p[1] + p[0]) / (2.0 * kTick_s * kTick_s);
  EXPECT_GT(a_W.norm(), 1.0);
  EXPECT_LT((felt_W - a_W - Vector3d(0.0, 0.0, robot::kGravity)).norm(), 0.1 * a_W.norm());
}

TEST_F(BodySensorsTest, GyroIsTheRateOfTheAttitude) {
  BodyWorld world(robot_.biped, robot_.urdf, {});
  world.push({.impulse_W_ns = {15.0, 10.0, 0.0}});
  step(world, 40);
  const Eigen::Quaterniond before = world.sensors().R_WI;
  const Vector3d gyro_before = world.sensors().gyro_I;
  step(world, 1);
  const Eigen::AngleAxisd turn(before.conjugate() * world.sensors().R_WI);
  const Vector3d gyro = 0.5 * (gyro_before + world.sensors().gyro_I);
  EXPECT_GT(gyro.norm(), 0.1);
  EXPECT_LT((turn.angle() * turn.axis() / kTick_s - gyro).norm(), 0.05 * gyro.norm());
}

TEST_F(BodySensorsTest, NoiseIsSeeded) {
  const BodyOptions options{.seed = 3, .encoder_noise_rad = 1e-3, .force_noise_n = 5.0};
  BodyWorld one(robot_.biped, robot_.urdf, options), clean(robot_.biped, robot_.urdf, {});
  BodyOptions reseeded = options;
  reseeded.seed = 4;
  BodyWorld two(robot_.biped, robot_.urdf, reseeded);
  double squares = 0.0, rate_squares = 0.0, force_squares = 0.0, moment_squares = 0.0;
  for (int i = 0; i < 50; ++i) {
    step(one, 1);
    step(clean, 1);
    squares += (one.sensors().q - clean.sensors().q).squaredNorm();
    rate_squares += (one.sensors().dq - clean.sensors().dq).squaredNorm();
    force_squares +=
        (one.sensors().foot_S[0].force - clean.sensors().foot_S[0].force).squaredNorm();
    moment_squares +=
        (one.sensors().foot_S[0].moment - clean.sensors().foot_S[0].moment).squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(squares / (50.0 * 30.0)), 1e-3, 1e-4);
  EXPECT_NEAR(std::sqrt(rate_squares / (50.0 * 30.0)), 0.1, 0.01);  // time constant of 10 ms
  EXPECT_NEAR(std::sqrt(force_squares / 150.0), 5.0, 1.0);
  EXPECT_NEAR(std::sqrt(moment_squares / 150.0), 0.5, 0.1);  // at 0.1 m
  EXPECT_EQ(one.truth().com_W_m, clean.truth().com_W_m);     // sensors do not move the robot
  step(two, 50);
  EXPECT_NE(one.sensors().q, two.sensors().q);
}

TEST_F(BodySensorsTest, TiltOfTheImuIsThatOfItsNoiseAtTheTime) {
  BodyWorld world(robot_.biped, robot_.urdf, {.seed = 11, .imu_tilt_rad = 0.01});
  BodyWorld clean(robot_.biped, robot_.urdf, {});
  const Noise noise(11, 0.01);
  for (int k = 0; k < 3; ++k) {
    step(world, 200);
    step(clean, 200);
    const Eigen::Quaterniond tilt = world.sensors().R_WI * clean.sensors().R_WI.conjugate();
    EXPECT_LT(tilt.angularDistance(noise.tilt(world.time_s())), 1e-9) << world.time_s();
  }
}

TEST(Noise, TiltIsSlowAndBounded) {
  const Noise noise(11, 0.01);
  double most = 0.0, fastest = 0.0;
  for (int i = 0; i < 20'000; ++i) {
    const Eigen::Quaterniond now = noise.tilt(0.005 * i), next = noise.tilt(0.005 * (i + 1));
    most = std::max(most, Eigen::AngleAxisd(now).angle());
    fastest = std::max(fastest, now.angularDistance(next) / 0.005);
  }
  EXPECT_GT(most, 0.008);
  EXPECT_LT(most, 0.0142);     // √2 of the bound a axis
  EXPECT_LT(fastest, 0.0245);  // 2π · 0.4 Hz at the half amplitude, two waves, two axes
}

}  // namespace
}  // namespace mimesis::hw::sim
