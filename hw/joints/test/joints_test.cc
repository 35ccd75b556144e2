#include "hw/joints/joints.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/error.h"
#include "common/testing/refusal.h"

namespace mimesis::hw {
namespace {

template <class F>
std::string refusal(F f) {
  return testing::refusal([&] { f(); }, "accepted");
}

TEST(Joints, OfAnArm) {
  const Joints joints = load_joints("lwr4.yaml");
  ASSERT_EQ(joints.count(), 7);
  EXPECT_EQ(joints.names[2], "A3");
  EXPECT_FALSE(joints.walks);
  EXPECT_DOUBLE_EQ(joints.home[3], 1.6);
  EXPECT_DOUBLE_EQ(joints.limits.a_max[0], 6.0) << "the file's";
  EXPECT_EQ(joints.drives, "cia402");
  EXPECT_EQ(joints.rate_hz, 200.0);
  EXPECT_DOUBLE_EQ(complete(std::vector<cia402::Axis>{}, joints)[0].rated_torque_n_m, 100.0);
}

TEST(Joints, ThatSlideAreRefused) {
  const std::string folder =
      std::filesystem::temp_directory_path() / ("slides-" + std::to_string(getpid()));
  std::filesystem::create_directory(folder);
  const std::string file = folder + "/lift.yaml";
  std::ofstream(file) << "name: lift\ndrives: cia402\nrate_hz: 200\nbase_m: [0, 0, 0]\ntool_m: [0, "
                         "0, 0.1]\njoints:\n"
                         "  - {type: slides, a_m: 0, alpha_rad: 0, d_m: 0, offset_rad: 0, q_min_m: "
                         "0, q_max_m: 0.5, v_max_m_s: 0.1, a_max_m_s2: 0.5}\n";
  EXPECT_EQ(refusal([&] { load_joints(file); }),
            file + ": joint 'A1' slides; the bridge and its drives move joints that turn [rad]");
  std::filesystem::remove_all(folder);
}

TEST(Joints, OfAWalkingRobot) {
  const Joints joints = load_joints("biped.urdf");
  ASSERT_EQ(joints.count(), 30);
  EXPECT_TRUE(joints.walks);
  EXPECT_EQ(joints.names[3], "left_knee");
  EXPECT_DOUBLE_EQ(joints.limits.q_max[3], 2.618);
  EXPECT_DOUBLE_EQ(joints.limits.v_max[3], 10.0);
  EXPECT_DOUBLE_EQ(joints.limits.a_max[3], 300.0);
  const std::vector<cia402::Axis> axes = complete(std::vector<cia402::Axis>{}, joints);
  EXPECT_EQ(axes[29].node_id, 30);
  EXPECT_DOUBLE_EQ(axes[3].rated_torque_n_m, 220.0);
  const JointLimits legs = part_of(joints.limits, 3, 2);
  EXPECT_EQ(legs.q_min.size(), 2);
  EXPECT_DOUBLE_EQ(legs.v_max[0], 10.0);
  EXPECT_DOUBLE_EQ(legs.v_max[1], 8.0);
}

TEST(Joints, OfABipedsFileBeginHalfSitting) {
  const Joints joints = load_joints("biped.yaml");
  ASSERT_EQ(joints.count(), 30);
  EXPECT_NEAR(joints.home[3], 0.8726646, 1e-6) << "the knee";
  EXPECT_DOUBLE_EQ(joints.limits.a_max[3], 300.0) << "the file's";
  EXPECT_EQ(joints.drives, "cia402");
  EXPECT_EQ(load_joints("biped.urdf").home[3], 0.0) << "a URDF alone has no posture";
}

TEST(Joints, PartsHaveTheirOwnLimits) {
  Joints joints = load_joints("biped.urdf");
  for (int i = 0; i < 30; ++i) joints.limits.a_max[i] = i;
  const JointLimits part = part_of(joints.limits, 3, 2);
  EXPECT_EQ(part.q_min, joints.limits.q_min.segment(3, 2));
  EXPECT_EQ(part.q_max, joints.limits.q_max.segment(3, 2));
  EXPECT_EQ(part.v_max, joints.limits.v_max.segment(3, 2));
  EXPECT_EQ(part.a_max, Eigen::Vector2d(3.0, 4.0));
}

TEST(Joints, GivenAxesKeepTheirTorques) {
  const Joints joints = load_joints("biped.urdf");
  std::vector<cia402::Axis> given(30);
  for (int i = 0; i < 30; ++i) given[static_cast<std::size_t>(i)].node_id = 30 - i;
  given[3].rated_torque_n_m = 7.0;
  const std::vector<cia402::Axis> axes = complete(given, joints);
  EXPECT_DOUBLE_EQ(axes[3].rated_torque_n_m, 7.0);
  EXPECT_DOUBLE_EQ(axes[4].rated_torque_n_m, 100.0);
  EXPECT_EQ(axes[0].node_id, 30);
}

/// A wheel on a post, as URDF.
Joints wheel(const std::string& limit) {
  const auto file = std::filesystem::temp_directory_path() /
                    ("joints_test_" + std::to_string(::getpid()) + ".urdf");
  std::ofstream(file) << R"(<robot name="wheel"><link name="post"/><link name="rim"/>
<joint name="axle" type="continuous"><parent link="post"/><child link="rim"/><axis xyz="0 1 0"/>)"
                      << limit << "</joint></robot>";
  try {
    const Joints joints = load_joints(file);
    std::filesystem::remove(file);
    return joints;
  } catch (const ConfigError&) {
    std::filesystem::remove(file);
    throw;
  }
}

TEST(Joints, WithoutEndsAreLimitedToWhatADriveCanCount) {
  const Joints joints = wheel(R"(<limit velocity="4" effort="3"/>)");
  ASSERT_EQ(joints.count(), 1);
  EXPECT_EQ(joints.limits.q_min[0], -1e3);
  EXPECT_EQ(joints.limits.q_max[0], 1e3);
  const cia402::Axis axis{.node_id = 1};
  EXPECT_LT(axis.to_increments(joints.limits.q_max[0]), 0x7FFFFFFF) << "fits into 607Dh";
}

TEST(Joints, WithoutAVelocityLimitAreRefused) {
  const std::string why = refusal([] { wheel(""); });
  EXPECT_NE(why.find("joint 'axle': expected a velocity limit, is inf"), std::string::npos) << why;
}

TEST(Buses, CarryEveryJointOnce) {
  const Joints joints = load_joints("biped.urdf");
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
  EXPECT_NE(refusal([] { load_joints("nobody.urdf"); }).find("nobody.urdf"), std::string::npos);
  EXPECT_NE(refusal([] { load_joints("nobody.yaml"); }).find("nobody.yaml"), std::string::npos);
}

TEST(Axes, AreToldInOneLine) {
  const std::vector<cia402::Axis> axes{{.node_id = 1},
                                       {.node_id = 2},
                                       {.node_id = 5, .sign = -1},
                                       {.node_id = 6, .offset_rad = 0.1}};
  EXPECT_EQ(text_of("models/a.yaml", axes),
            "a.yaml: nodes 1 2 at 160000/rad 5 at -160000/rad 6 at 160000/rad from 0.1 rad");
}

}  // namespace
}  // namespace mimesis::hw
