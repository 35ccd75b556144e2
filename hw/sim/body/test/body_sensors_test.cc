#include <gtest/gtest.h>

#include "hw/sim/body/body_world.h"
#include "hw/sim/body/test/bodies.h"

namespace mimesis::hw::sim {
namespace {

using Eigen::Vector3d;

class BodySensorsTest : public ::testing::Test {
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
  step(world, 1);
  const Eigen::AngleAxisd turn(before.conjugate() * world.sensors().R_WI);
  const Vector3d gyro = world.sensors().gyro_I;
  EXPECT_GT(gyro.norm(), 0.1);
  EXPECT_LT((turn.angle() * turn.axis() / kTick_s - gyro).norm(), 1e-9);
}

/// A hand that is pulled gives way behind the motor, which stays: its encoder sees nothing.
TEST_F(BodySensorsTest, EncodersOnTheMotorsDoNotSeeTheSprings) {
  BodyWorld joint(robot_.biped, robot_.urdf, {});
  BodyWorld motor(robot_.biped, robot_.urdf, {.senses = {.motor_encoders = true}});
  turn("left_elbow", -0.01);
  for (BodyWorld* world : {&joint, &motor}) {
    world->pull(robot_.biped.hand[0], Vector3d::Zero(), Vector3d(0.0, 0.0, 20.0));
    step(*world, 100);
  }
  EXPECT_LT((motor.sensors().q - target_).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_GT((joint.sensors().q - target_).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_EQ(joint.truth().hand_W_m[0], motor.truth().hand_W_m[0]) << "sensors move no robot";
}

TEST_F(BodySensorsTest, NoiseIsSeeded) {
  const BodyOptions options{.seed = 3, .senses = {.encoder_noise_rad = 1e-3, .force_noise_n = 5.0}};
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
  BodyWorld world(robot_.biped, robot_.urdf, {.seed = 11, .senses = {.imu_tilt_rad = 0.01}});
  BodyWorld clean(robot_.biped, robot_.urdf, {});
  const SensorErrors noise({.imu_tilt_rad = 0.01}, 11);
  for (int k = 0; k < 3; ++k) {
    step(world, 200);
    step(clean, 200);
    const Eigen::Quaterniond tilt = world.sensors().R_WI * clean.sensors().R_WI.conjugate();
    EXPECT_LT(tilt.angularDistance(noise.tilt(world.time_s())), 1e-9) << world.time_s();
  }
}

BodySensors at_rest() {
  BodySensors s;
  s.q = s.dq = Eigen::VectorXd::Zero(2);
  s.R_WI = Eigen::AngleAxisd(0.3, Vector3d(1.0, 2.0, 3.0).normalized());
  s.specific_force_I = s.R_WI.conjugate() * Vector3d(0.0, 0.0, robot::kGravity);
  return s;
}

TEST(SensorErrors, ExactSensesSayTheTruth) {
  SensorErrors errors(Senses{}, 1);
  BodySensors s = at_rest();
  errors.spoil(0.7, s);
  EXPECT_LT((s.specific_force_I - at_rest().specific_force_I).norm(), 1e-12);
  EXPECT_EQ(s.R_WI.coeffs(), at_rest().R_WI.coeffs());
  EXPECT_TRUE(s.gyro_I.isZero(0.0) && s.q.isZero(0.0) && s.foot_S[0].force.isZero(0.0));
}

/// At rest the accelerometer's direction agrees with the announced attitude.
TEST(SensorErrors, AccelerometerTiltsAsTheAttitudeDoes) {
  SensorErrors errors({.imu_tilt_rad = 0.05}, 1);
  BodySensors s = at_rest();
  errors.spoil(0.7, s);
  const Vector3d up = s.R_WI * s.specific_force_I / robot::kGravity;
  EXPECT_LT((up - Vector3d::UnitZ()).norm(), 1e-9);
  EXPECT_GT((s.specific_force_I - at_rest().specific_force_I).norm(), 0.05);
}

TEST(SensorErrors, BiasesStayAndNoiseHasItsDeviation) {
  SensorErrors errors(kRealSenses, 5), biased({.gyro_bias_rad_s = 0.0087}, 5);
  Vector3d gyro = Vector3d::Zero();
  double squares = 0.0;
  constexpr int kReadings = 2000;
  BodySensors bias = at_rest();
  biased.spoil(0.0, bias);
  for (int i = 0; i < kReadings; ++i) {
    BodySensors s = at_rest();
    errors.spoil(0.005 * i, s);
    gyro += s.gyro_I / kReadings;
    squares += (s.gyro_I - bias.gyro_I).squaredNorm() / (3 * kReadings);
  }
  EXPECT_GT(bias.gyro_I.norm(), 0.002);
  EXPECT_LE(bias.gyro_I.cwiseAbs().maxCoeff(), 0.0087);
  EXPECT_LT((gyro - bias.gyro_I).norm(), 2e-4);  // 0.002/√2000 an axis, four times
  EXPECT_NEAR(std::sqrt(squares), kRealSenses.gyro_noise_rad_s, 1e-4);
  SensorErrors other(kRealSenses, 6);
  BodySensors s = at_rest(), t = at_rest();
  other.spoil(0.0, s);
  errors.spoil(0.0, t);
  EXPECT_NE(s.specific_force_I, t.specific_force_I) << "another seed is another IMU";
}

TEST(SensorErrors, TiltIsSlowAndBounded) {
  const SensorErrors noise({.imu_tilt_rad = 0.01}, 11);
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
