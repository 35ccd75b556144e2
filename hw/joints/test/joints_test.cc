#include "hw/joints/joints.h"

#include <gtest/gtest.h>

#include "common/error.h"

namespace mimesis::hw {
namespace {

template <class F>
std::string refusal(F f) {
  try {
    f();
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(Joints, OfAnArm) {
  const Joints joints = load_joints("lwr4.yaml", 300.0);
  ASSERT_EQ(joints.count(), 7);
  EXPECT_EQ(joints.names[2], "A3");
  EXPECT_FALSE(joints.walks);
  EXPECT_DOUBLE_EQ(joints.home[3], 1.6);
  EXPECT_LT(joints.limits.a_max[0], 100.0) << "the file's";
  EXPECT_DOUBLE_EQ(complete(std::vector<arm::Axis>{}, joints)[0].rated_torque_n_m, 100.0);
}

TEST(Joints, OfAWalkingRobot) {
  const Joints joints = load_joints("biped.urdf", 300.0);
  ASSERT_EQ(joints.count(), 30);
  EXPECT_TRUE(joints.walks);
  EXPECT_EQ(joints.names[3], "left_knee");
  EXPECT_DOUBLE_EQ(joints.limits.q_max[3], 2.618);
  EXPECT_DOUBLE_EQ(joints.limits.v_max[3], 10.0);
  EXPECT_DOUBLE_EQ(joints.limits.a_max[3], 300.0);
  const std::vector<arm::Axis> axes = complete(std::vector<arm::Axis>{}, joints);
  EXPECT_EQ(axes[29].node_id, 30);
  EXPECT_DOUBLE_EQ(axes[3].rated_torque_n_m, 220.0);
  const arm::JointLimits legs = part_of(joints.limits, 3, 2);
  EXPECT_EQ(legs.q_min.size(), 2);
  EXPECT_DOUBLE_EQ(legs.v_max[0], 10.0);
  EXPECT_DOUBLE_EQ(legs.v_max[1], 8.0);
}

TEST(Buses, CarryEveryJointOnce) {
  const Joints joints = load_joints("biped.urdf", 300.0);
  EXPECT_EQ(complete(std::vector<BusShare>{}, "embedded:x", joints)[0].joints, 30);
  EXPECT_EQ(complete({{"embedded:a", 12}, {"embedded:b", 18}}, "", joints).size(), 2u);
  EXPECT_EQ(refusal([&] {
              complete({{"embedded:a", 12}, {"embedded:b", 17}}, "", joints);
            }),
            "buses: carry 29 joints, the robot has 30");
  EXPECT_EQ(refusal([&] {
              complete({{"embedded:a", 12}, {"embedded:a", 18}}, "", joints);
            }),
            "buses[1].can: 'embedded:a' is used by buses[0]");
  EXPECT_EQ(refusal([&] { complete({{.node_id = 1}}, joints); }),
            "axes: 1 given, the robot has 30 joints");
}

TEST(Joints, OfNoFile) {
  EXPECT_NE(refusal([] { load_joints("nobody.urdf", 300.0); }).find("nobody.urdf"),
            std::string::npos);
  EXPECT_NE(refusal([] { load_joints("nobody.yaml", 300.0); }).find("nobody.yaml"),
            std::string::npos);
}

}  // namespace
}  // namespace mimesis::hw
