#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

#include "common/error.h"
#include "common/testing/refusal.h"
#include "hw/sim/body/body_world.h"
#include "hw/sim/body/test/bodies.h"

namespace mimesis::hw::sim {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class BodyTroubleTest : public ::testing::TestWithParam<Plant> {
 protected:
  void step(BodyWorld& world, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      world.step({target_.data(), static_cast<std::size_t>(target_.size())}, kTick_s);
    }
  }
  int joint(const std::string& name) const { return robot_.biped.tree.require_joint(name); }

  const TestRobot robot_ = test_robot();
  Eigen::VectorXd target_ = robot_.biped.half_sitting;
  const BodyOptions plant_{.plant = GetParam()};
};
INSTANTIATE_TEST_SUITE_P(Plants, BodyTroubleTest, ::testing::Values(Plant::springs, Plant::servo));

TEST_P(BodyTroubleTest, JointsFollowTheirTargets) {
  BodyWorld world(robot_.biped, robot_.urdf, plant_);
  for (const char* name : {"left_shoulder_pitch", "waist_yaw", "right_gripper"}) {
    target_[joint(name)] += 0.2;
  }
  target_[joint("neck_pitch")] = 9.0;  // cut to its limit
  step(world, 300);
  target_[joint("neck_pitch")] = robot_.biped.tree.upper()[joint("neck_pitch")];
  EXPECT_LT((world.sensors().q - target_).cwiseAbs().maxCoeff(), 0.015);
}

TEST_P(BodyTroubleTest, MotorThatIsOffGivesNoTorque) {
  BodyWorld world(robot_.biped, robot_.urdf, plant_);
  const int elbow = joint("left_elbow");
  world.fail(elbow, MotorFault::off);
  double most = 0.0;
  for (int i = 0; i < 200; ++i) {  // it swings
    step(world, 1);
    EXPECT_NEAR(world.sensors().torque[elbow], 0.0, 1e-3);
    most = std::max(most, std::abs(world.sensors().q[elbow] - target_[elbow]));
  }
  EXPECT_GT(most, 0.2);
  EXPECT_FALSE(world.truth().fell);
  world.fail(joint("left_knee"), MotorFault::off);
  world.fail(joint("right_knee"), MotorFault::off);
  step(world, 300);
  EXPECT_TRUE(world.truth().fell);
}

TEST_P(BodyTroubleTest, LockedMotorStaysWhereItIs) {
  BodyWorld world(robot_.biped, robot_.urdf, plant_);
  step(world, 100);
  const int shoulder = joint("right_shoulder_pitch"), waist = joint("waist_yaw");
  world.fail(shoulder, MotorFault::locked);
  world.fail(waist, MotorFault::locked);
  const Eigen::VectorXd before = world.sensors().q;
  target_[shoulder] += 0.5;
  target_[waist] += 0.3;
  step(world, 200);
  EXPECT_NEAR(world.sensors().q[shoulder], before[shoulder], 0.01);
  EXPECT_NEAR(world.sensors().q[waist], before[waist], 0.01);
}

/// Its gear holds, however little its motor can.
TEST_P(BodyTroubleTest, LockedMotorHoldsWhateverItBears) {
  BodyWorld world(robot_.biped, robot_.urdf, plant_);
  step(world, 100);
  const int elbow = joint("left_elbow");
  const double before = world.sensors().q[elbow];
  for (const MotorFault fault : {MotorFault::weak, MotorFault::weak, MotorFault::locked}) {
    world.fail(elbow, fault);
  }
  world.pull(robot_.biped.hand[0], Eigen::Vector3d::Zero(), {0.0, 0.0, -15.0});
  step(world, 200);
  const double could = 0.04 * robot_.biped.tree.moved(elbow).max_effort;
  EXPECT_GT(std::abs(world.sensors().torque[elbow]), 1.5 * could);
  EXPECT_NEAR(world.sensors().q[elbow], before, 0.01);
}

TEST_P(BodyTroubleTest, WeakMotorGivesAFifth) {
  BodyWorld world(robot_.biped, robot_.urdf, plant_);
  step(world, 100);
  // a load at the trunk that the waist holds, but not with a fifth: 60 N at 0.7 m are 42 N m
  const int chest = robot_.biped.tree.require_link("chest"), waist = joint("waist_pitch");
  world.fail(waist, MotorFault::weak);
  const double most = 0.2 * robot_.biped.tree.moved(waist).max_effort;
  world.pull(chest, {0.0, 0.0, 0.3}, {0.0, 0.0, 0.0});
  for (int i = 0; i < 100; ++i) {
    target_[waist] = std::min(0.7, 0.01 * i);
    step(world, 1);
    EXPECT_LT(std::abs(world.sensors().torque[waist]), 1.1 * most);
  }
}

TEST_P(BodyTroubleTest, TorqueShareLimitsTheRealTorque) {
  BodyOptions options = plant_;
  options.motor_torque_share = 0.1;
  BodyWorld world(robot_.biped, robot_.urdf, options);
  const int knee = joint("left_knee");
  const double most = 0.1 * robot_.biped.tree.moved(knee).max_effort;  // 22 N m, it needs 30
  double least = 0.0;
  for (int i = 0; i < 20; ++i) {
    step(world, 1);
    least = std::min(least, world.sensors().torque[knee]);
  }
  EXPECT_LT(least, -0.9 * most);
  EXPECT_GT(least, -1.1 * most);
  step(world, 300);
  EXPECT_TRUE(world.truth().fell);
}

TEST_P(BodyTroubleTest, SpeedShareLimitsTheJoint) {
  BodyOptions options = plant_;
  options.motor_speed_share = 0.1;
  BodyWorld world(robot_.biped, robot_.urdf, options);
  const int waist = joint("waist_yaw");
  const double most = 0.1 * robot_.biped.tree.moved(waist).max_speed;
  step(world, 50);
  target_[waist] += 0.3;
  const double before = world.sensors().q[waist];
  step(world, 50);
  EXPECT_NEAR(world.sensors().q[waist] - before, 0.25 * most, 0.1 * 0.25 * most);
}

TEST_P(BodyTroubleTest, BadTargetsHoldTheSetPoint) {
  BodyWorld world(robot_.biped, robot_.urdf, plant_);
  target_[joint("left_knee")] = kNan;
  target_[joint("left_elbow")] -= 0.1;
  step(world, 200);
  EXPECT_EQ(world.trouble(),
            "target of joint 'left_knee': nan, expected a number: its set-point is held");
  EXPECT_FALSE(world.truth().fell);
  EXPECT_NEAR(world.sensors().q[joint("left_elbow")], target_[joint("left_elbow")], 0.01);
  world.step({target_.data(), 29}, kTick_s);
  EXPECT_EQ(world.trouble(), "target: 29 values, expected 30: all set-points are held");
  target_ = robot_.biped.half_sitting;
  step(world, 200);
  EXPECT_NEAR(world.sensors().q[joint("left_elbow")], target_[joint("left_elbow")], 0.01);
  EXPECT_FALSE(world.truth().fell);
}

TEST(BodyTrouble, NonsenseIsRefusedWithAReason) {
  const TestRobot robot = test_robot();
  BodyWorld world(robot.biped, robot.urdf, {});
  EXPECT_THROW(world.push({.link = "tail"}), ConfigError);
  world.push({.impulse_W_ns = {kNan, 0.0, 0.0}});
  EXPECT_NE(world.trouble().find("push"), std::string::npos);
  world.step(robot.half_sitting(), -1.0);
  EXPECT_TRUE(world.truth().com_W_m.allFinite());
}

std::string refusal(const TestRobot& robot, const std::string& urdf, const BodyOptions& options) {
  return testing::refusal([&] { BodyWorld world(robot.biped, urdf, options); });
}

TEST(BodyTrouble, PlatesWithoutSizeAreRefused) {
  const TestRobot robot = test_robot();
  EXPECT_NE(refusal(robot, robot.urdf, {.plates = {{.height_m = 0.0}}}).find("plate"),
            std::string::npos);
}

/// The URDF with one text replaced, in a file of its own.
class DamagedUrdf {
 public:
  DamagedUrdf(const std::string& from, const std::string& what, const std::string& by)
      : path_(std::filesystem::temp_directory_path() /
              ("mimesis_damaged_" + std::to_string(::getpid()) + ".urdf")) {
    std::ifstream in(from);
    std::string text{std::istreambuf_iterator<char>(in), {}};
    if (const auto at = text.find(what); at != std::string::npos) text.replace(at, what.size(), by);
    std::ofstream(path_) << text;
  }
  ~DamagedUrdf() { std::filesystem::remove(path_); }
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

TEST(BodyTrouble, AFileThatIsNoRobotsIsRefused) {
  const TestRobot robot = test_robot();
  const auto damaged = [&](const std::string& what, const std::string& by) {
    const DamagedUrdf file(robot.urdf, what, by);
    return refusal(robot, file.path(), {});
  };
  EXPECT_NE(refusal(robot, "/nowhere.urdf", {}).find("/nowhere.urdf"), std::string::npos);
  EXPECT_NE(damaged("</robot>", "").find("expected a URDF file"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::hw::sim
