#include "hw/sim/body/body_world.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "common/robot/testing/momentum.h"
#include "common/shared_data.h"
#include "hw/sim/body/test/bodies.h"

namespace mimesis::hw::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

void stand(BodyWorld& world, const TestRobot& robot, double duration_s) {
  for (int i = 0; i < duration_s / kTick_s - 0.5; ++i) world.step(robot.half_sitting(), kTick_s);
}

class Plants : public ::testing::TestWithParam<Plant> {};
INSTANTIATE_TEST_SUITE_P(BodyWorld, Plants, ::testing::Values(Plant::springs, Plant::servo));

TEST_P(Plants, StandStill) {
  const TestRobot robot = test_robot();
  BodyWorld world(robot.biped, robot.urdf, {.plant = GetParam()});
  const Vector3d start = world.truth().com_W_m;
  stand(world, robot, 3.0);
  const BodyTruth& truth = world.truth();
  EXPECT_NEAR(truth.time_s, 3.0, 1e-12);
  EXPECT_NEAR(truth.normal_n[0] + truth.normal_n[1], robot.weight_n(), 1e-3 * robot.weight_n());
  EXPECT_LT((truth.com_W_m - start).norm(), 0.002);
  EXPECT_FALSE(truth.fell) << truth.how;
  EXPECT_EQ(world.trouble(), "");
}

TEST_P(Plants, StandStillOnAnotherRobot) {
  if (!std::filesystem::exists(shared_data("data/robots/jvrc1.urdf"))) {
    GTEST_SKIP() << "not here: no data/robots/jvrc1.urdf in the shared data";
  }
  const TestRobot robot = test_robot("jvrc1.yaml");
  BodyWorld world(robot.biped, robot.urdf, {.plant = GetParam()});
  const Vector3d start = world.truth().com_W_m;
  stand(world, robot, 3.0);
  const BodyTruth& truth = world.truth();
  EXPECT_NEAR(truth.normal_n[0] + truth.normal_n[1], robot.weight_n(), 2e-3 * robot.weight_n());
  EXPECT_LT((truth.com_W_m - start).norm(), 0.02);  // it sways, because it is not balanced
  EXPECT_FALSE(truth.fell) << truth.how;
}

/// Where the ground must push if the robot moves so: momenta of our own dynamics, which read the
/// URDF without DART, against DART's contacts. The robot sways after a push.
TEST_P(Plants, ZmpOfContactsIsThatOfMomenta) {
  const TestRobot robot = test_robot();
  BodyWorld world(robot.biped, robot.urdf, {.plant = GetParam()});
  stand(world, robot, 0.5);
  world.push({.at_s = 0.5, .impulse_W_ns = {5.0, 0.0, 0.0}});
  robot::RobotMotion motion(robot.biped.tree.dof());
  const double mass = robot.biped.tree.mass_kg();
  robot::Momentum before{Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
  Vector2d squares = Vector2d::Zero(), last_zmp = Vector2d::Zero();
  double farthest = 0.0;
  int count = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Isometry3d X_WB = world.truth().X_WB;
    const Eigen::VectorXd q = world.sensors().q;
    world.step(robot.half_sitting(), kTick_s);
    // mean velocities of the tick
    const Eigen::Isometry3d& X_WB_now = world.truth().X_WB;
    motion.X_WB = X_WB;
    motion.q = 0.5 * (q + world.sensors().q);
    motion.dq = (world.sensors().q - q) / kTick_s;
    motion.v_W = (X_WB_now.translation() - X_WB.translation()) / kTick_s;
    const Eigen::AngleAxisd turn(X_WB_now.linear() * X_WB.linear().transpose());
    motion.omega_W = turn.angle() * turn.axis() / kTick_s;
    motion.X_WB.translation() = 0.5 * (X_WB_now.translation() + X_WB.translation());
    const robot::Momentum now = robot::momentum(robot.biped.tree, motion);
    if (world.time_s() > 0.65) {  // the push is over
      const Vector3d com = 0.5 * (now.com_W_m + before.com_W_m);
      const Vector3d force =
          (now.linear_W - before.linear_W) / kTick_s + Vector3d(0.0, 0.0, mass * robot::kGravity);
      const Vector3d moment = (now.angular_W - before.angular_W) / kTick_s + com.cross(force);
      const Vector2d zmp = robot::zmp_of({force, moment});
      squares += (zmp - 0.5 * (world.truth().zmp_W_m + last_zmp)).cwiseAbs2();
      farthest = std::max(farthest, std::abs(zmp.x()));
      ++count;
    }
    before = now;
    last_zmp = world.truth().zmp_W_m;
  }
  EXPECT_GT(farthest, 0.03);  // there was something to compare
  EXPECT_LT((squares / count).cwiseSqrt().maxCoeff(), 0.002);
}

TEST(BodyWorld, PushIsAnImpulse) {
  const TestRobot robot = test_robot();
  const double mass = robot.biped.tree.mass_kg();
  BodyWorld world(robot.biped, robot.urdf, {});
  const Vector3d lift(0.0, 0.0, 2.0 * robot.weight_n());
  world.pull(0, robot.biped.tree.link(0).inertia.com_m, lift);
  stand(world, robot, 0.4);
  world.pull(0, Vector3d::Zero(), Vector3d::Zero());
  stand(world, robot, 0.05);
  ASSERT_EQ(world.truth().normal_n[0] + world.truth().normal_n[1], 0.0) << "does not fly";
  const Vector3d impulse(3.0, -2.0, 1.0);
  const Vector3d before = world.truth().com_v_W;
  world.push({.at_s = 0.0, .duration_s = 0.03, .impulse_W_ns = impulse});  // past: at once
  stand(world, robot, 0.1);
  const Vector3d gained = mass * (world.truth().com_v_W - before);
  EXPECT_LT((gained - impulse - Vector3d(0.0, 0.0, -0.1 * robot.weight_n())).norm(), 0.01);
}

TEST(BodyWorld, PushStartsAtItsTimeAndOnItsLink) {
  const TestRobot robot = test_robot();
  BodyWorld pushed(robot.biped, robot.urdf, {}), still(robot.biped, robot.urdf, {});
  pushed.push({.at_s = 0.2, .impulse_W_ns = {0.0, 1.0, 0.0}, .link = "left_grip"});
  stand(pushed, robot, 0.2);
  stand(still, robot, 0.2);
  EXPECT_EQ(pushed.truth().hand_W_m[0], still.truth().hand_W_m[0]);
  stand(pushed, robot, 0.05);
  stand(still, robot, 0.05);
  EXPECT_GT(pushed.truth().hand_W_m[0].y(), still.truth().hand_W_m[0].y() + 1e-3);
  EXPECT_NEAR(pushed.truth().hand_W_m[1].y(), still.truth().hand_W_m[1].y(), 1e-3);
}

TEST(BodyWorld, HardPushMakesItFallAndItStaysSo) {
  const TestRobot robot = test_robot();
  BodyWorld world(robot.biped, robot.urdf, {});
  world.push({.impulse_W_ns = {40.0, 0.0, 0.0}});
  stand(world, robot, 2.0);
  EXPECT_TRUE(world.truth().fell);
  EXPECT_NE(world.truth().how.find("trunk tilted by 0.9"), std::string::npos) << world.truth().how;
  const std::string how = world.truth().how;
  stand(world, robot, 0.5);
  EXPECT_EQ(world.truth().how, how);
}

/// A waist bent by 1.1 rad, slowly, is a bow; hips and all joints as sent and the same tilt is
/// none.
TEST(BodyWorld, BowIsNoFall) {
  const TestRobot robot = test_robot();
  BodyWorld world(robot.biped, robot.urdf, {});
  Eigen::VectorXd q = robot.biped.half_sitting;
  const int pitch = robot.biped.tree.require_joint("waist_pitch");
  const int hips[] = {robot.biped.tree.require_joint("left_hip_pitch"),
                      robot.biped.tree.require_joint("right_hip_pitch")};
  const int ankles[] = {robot.biped.tree.require_joint("left_ankle_pitch"),
                        robot.biped.tree.require_joint("right_ankle_pitch")};
  for (int i = 0; i < 600; ++i) {
    const double share = std::min(1.0, i / 500.0);
    q[pitch] = share * 0.75;
    // the pelvis goes back and bends as far as balance needs
    for (const int hip : hips) q[hip] = robot.biped.half_sitting[hip] - share * 0.36;
    for (const int ankle : ankles) q[ankle] = robot.biped.half_sitting[ankle] + share * 0.06;
    world.step({q.data(), static_cast<std::size_t>(q.size())}, 0.005);
  }
  const double bent = std::acos(world.truth().X_WB.linear()(2, 2)) + q[pitch];
  EXPECT_GT(bent, 0.95);
  EXPECT_FALSE(world.truth().fell) << world.truth().how;
}

TEST(BodyWorld, SlopeTiltsTheRobotAndItsSensors) {
  const TestRobot robot = test_robot();
  constexpr double kSlope = 0.05;
  BodyWorld world(robot.biped, robot.urdf, {.slope_rad = {kSlope, 0.0}});
  stand(world, robot, 2.0);
  ASSERT_FALSE(world.truth().fell);
  Vector3d force_S = world.sensors().foot_S[0].force + world.sensors().foot_S[1].force;
  EXPECT_NEAR(force_S.x(), -robot.weight_n() * std::sin(kSlope), 0.01 * robot.weight_n());
  EXPECT_NEAR(force_S.z(), robot.weight_n() * std::cos(kSlope), 0.01 * robot.weight_n());
  // downhill ahead: the pelvis looks down, gravity pulls forward
  EXPECT_NEAR(world.sensors().R_WI.toRotationMatrix()(2, 0), -std::sin(kSlope), 0.01);
  EXPECT_NEAR(world.sensors().specific_force_I.x(), -robot::kGravity * std::sin(kSlope), 0.15);
  EXPECT_LT(world.truth().X_WS[0].translation().head<1>().norm(), 0.002);  // does not slide
}

TEST(BodyWorld, SlipperySlopeDoesNotHold) {
  const TestRobot robot = test_robot();
  BodyWorld world(robot.biped, robot.urdf, {.friction = 0.05, .slope_rad = {0.1, 0.0}});
  stand(world, robot, 1.0);
  EXPECT_GT(world.truth().X_WS[0].translation().x(), 0.02);
}

TEST(BodyWorld, PlateLiftsTheFootOnIt) {
  const TestRobot robot = test_robot();
  BodyWorld world(robot.biped, robot.urdf,
                  {.plates = {{.center_W_m = {0.0, 0.2}, .half_m = {0.5, 0.2}}}});
  EXPECT_NEAR(world.truth().X_WS[1].translation().z(), 0.005, 1e-9);  // starts above the ground
  stand(world, robot, 2.0);
  ASSERT_FALSE(world.truth().fell);
  EXPECT_NEAR(world.truth().X_WS[0].translation().z(), 0.005, 0.001);
  EXPECT_LT(world.truth().X_WS[1].translation().z(), 0.002);
  double mean = 0.0;  // it sways
  for (int i = 0; i < 200; ++i) {
    world.step(robot.half_sitting(), kTick_s);
    mean += (world.truth().normal_n[0] + world.truth().normal_n[1]) / 200.0;
  }
  EXPECT_NEAR(mean, robot.weight_n(), 3.0);
}

TEST(BodyWorld, PayloadWeighs) {
  const TestRobot robot = test_robot();
  BodyWorld world(robot.biped, robot.urdf, {.payload_kg = 5.0});
  stand(world, robot, 2.0);
  const double weight = robot.weight_n() + 5.0 * robot::kGravity;
  EXPECT_NEAR(world.truth().normal_n[0] + world.truth().normal_n[1], weight, 1e-3 * weight);
}

/// Torque with which a joint of a robot at rest holds its loads: weights, a payload in the trunk, a
/// pull on the left hand.
double held_n_m(const BodyWorld& world, const TestRobot& robot, int joint, double payload_kg,
                const Vector3d& pull_W_n) {
  const robot::RobotTree& tree = robot.biped.tree;
  robot::Kinematics at(tree);
  at.update(world.truth().X_WB, world.sensors().q);
  const int first = tree.require_link(tree.moved(joint).name), hand = robot.biped.hand[0];
  const Eigen::Isometry3d& X_WL = at.X_WL(first);
  Vector3d moment = Vector3d::Zero();  // about the joint
  for (int i = 0; i < static_cast<int>(tree.links().size()); ++i) {
    if (!tree.carries(first, i)) continue;
    const double mass = tree.link(i).inertia.mass_kg + (i == robot.biped.trunk ? payload_kg : 0.0);
    const Vector3d arm = at.X_WL(i) * tree.link(i).inertia.com_m - X_WL.translation();
    moment += arm.cross(Vector3d(0.0, 0.0, -mass * robot::kGravity));
    if (i == hand) moment += (at.X_WL(i).translation() - X_WL.translation()).cross(pull_W_n);
  }
  return -moment.dot(X_WL.linear() * tree.moved(joint).axis);
}

/// Springs: stiff ones in legs and trunk, softer ones in the arms. Servos: legs and trunk do not
/// give, but for the springs of the knees and the soft bushes of the ankles.
TEST_P(Plants, GiveUnderTheirLoads) {
  const TestRobot robot = test_robot();
  const bool servos = GetParam() == Plant::servo;
  BodyWorld world(robot.biped, robot.urdf, {.plant = GetParam()});
  stand(world, robot, 3.0);
  const auto gives = [&](const std::string& name) {
    const int joint = robot.biped.tree.require_joint(name);
    const double torque = world.sensors().torque[joint];
    EXPECT_GT(std::abs(torque), 0.01) << name << " bears nothing";
    return (robot.biped.half_sitting[joint] - world.sensors().q[joint]) / torque;
  };
  EXPECT_NEAR(gives("left_elbow"), 1.0 / 3000.0, 0.1 / 3000.0);
  EXPECT_NEAR(gives("left_shoulder_roll"), 1.0 / 3000.0, 0.1 / 3000.0);
  EXPECT_NEAR(gives("waist_pitch"), servos ? 0.0 : 1.0 / 6000.0, 0.1 / 6000.0);
  EXPECT_NEAR(gives("left_hip_roll"), 0.0, 1e-5);  // a closed chain: it cannot
  // On the ground springs are softer than they are [docs/walking.md 7.2].
  EXPECT_NEAR(gives("left_knee"), 1.0 / 4200.0, 0.1 / 4200.0);
  EXPECT_NEAR(gives("left_ankle_pitch"), servos ? 1.0 / 537.0 : 1.0 / 880.0, 0.15 / 537.0);
}

TEST_P(Plants, ThePayloadIsInTheLoadOfTheWaist) {
  const TestRobot robot = test_robot();
  const int waist = robot.biped.tree.require_joint("waist_pitch");
  constexpr double kPayload_kg = 8.0;
  BodyWorld world(robot.biped, robot.urdf, {.plant = GetParam(), .payload_kg = kPayload_kg});
  Eigen::VectorXd target = robot.biped.half_sitting;
  for (int i = 0; i < 400; ++i) {
    target[waist] = robot.biped.half_sitting[waist] + std::min(0.2, 0.001 * i);
    world.step({target.data(), static_cast<std::size_t>(target.size())}, kTick_s);
  }
  ASSERT_FALSE(world.truth().fell) << world.truth().how;
  const double expected = held_n_m(world, robot, waist, kPayload_kg, Vector3d::Zero());
  ASSERT_GT(std::abs(expected - held_n_m(world, robot, waist, 0.0, Vector3d::Zero())), 1.0);
  EXPECT_NEAR(world.sensors().torque[waist], expected, 0.5);  // it sways a little
}

TEST_P(Plants, APullIsInTheLoadOfTheArm) {
  const TestRobot robot = test_robot();
  const int elbow = robot.biped.tree.require_joint("left_elbow");
  BodyWorld world(robot.biped, robot.urdf, {.plant = GetParam()});
  const Vector3d force(6.0, 0.0, -6.0);
  world.pull(robot.biped.hand[0], Vector3d::Zero(), force);
  stand(world, robot, 2.0);
  const double expected = held_n_m(world, robot, elbow, 0.0, force);
  ASSERT_GT(std::abs(expected - held_n_m(world, robot, elbow, 0.0, Vector3d::Zero())), 0.5);
  EXPECT_NEAR(world.sensors().torque[elbow], expected, 0.05);
}

/// Equal bits, independent of other simulations in this process.
TEST_P(Plants, AreDeterministicAndApart) {
  const TestRobot robot = test_robot();
  const BodyOptions options{.plant = GetParam(), .seed = 7, .senses = {.encoder_noise_rad = 1e-4}};
  const Push push{.at_s = 0.1, .impulse_W_ns = {2.0, 3.0, 0.0}};
  const auto state = [](const BodyWorld& world) {
    Eigen::VectorXd all(world.sensors().q.size() * 2 + 9);
    all << world.sensors().q, world.sensors().torque, world.truth().com_W_m,
        world.sensors().foot_S[0].moment, world.sensors().gyro_I;
    return all;
  };
  BodyWorld alone(robot.biped, robot.urdf, options);
  alone.push(push);
  stand(alone, robot, 0.5);
  BodyWorld one(robot.biped, robot.urdf, options), other(robot.biped, robot.urdf, {});
  one.push(push);
  other.push({.impulse_W_ns = {0.0, 9.0, 0.0}});
  for (int i = 0; i < 100; ++i) {
    one.step(robot.half_sitting(), kTick_s);
    other.step(robot.half_sitting(), kTick_s);
  }
  EXPECT_EQ(state(one), state(alone));
  EXPECT_NE(state(one), state(other));
}

}  // namespace
}  // namespace mimesis::hw::sim
