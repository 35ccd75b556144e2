#include "common/robot/robot_tree.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "common/error.h"
#include "common/robot/test/small_robot.h"
#include "common/robot/test/test_bipeds.h"
#include "common/testing/refusal.h"

namespace mimesis::robot {
namespace {

using Eigen::Vector3d;

TEST(RobotTree, ReadsLinksJointsAndMasses) {
  const RobotTree tree = read_urdf(write_urdf(kSmallRobot));
  EXPECT_EQ(tree.name(), "small");
  ASSERT_EQ(tree.links().size(), 5u);
  ASSERT_EQ(tree.dof(), 3);
  EXPECT_EQ(tree.joint_names(), (std::vector<std::string>{"shoulder", "slide", "turn"}));
  const Link& arm = tree.link(tree.require_link("arm"));
  EXPECT_EQ(arm.type, JointType::revolute);
  EXPECT_EQ(tree.link(arm.parent).name, "base");
  EXPECT_LT((arm.X_PJ.translation() - Vector3d(0.1, 0.2, 0.3)).norm(), 1e-15);
  EXPECT_LT((arm.X_PJ.linear() * Vector3d::UnitX() - Vector3d::UnitY()).norm(), 1e-9);  // yaw 90°
  EXPECT_LT((arm.axis - Vector3d(0.6, 0.0, 0.8)).norm(), 1e-12);  // made a unit vector
  EXPECT_EQ(arm.lower, -1.0);
  EXPECT_EQ(arm.upper, 2.0);
  EXPECT_EQ(arm.max_speed, 3.0);
  EXPECT_EQ(arm.max_effort, 40.0);
  EXPECT_EQ(arm.inertia.mass_kg, 2.0);
  EXPECT_LT((arm.inertia.com_m - Vector3d(0.0, 0.0, -0.1)).norm(), 1e-15);
  // given about axes turned by 90° about z: xx and yy change places
  EXPECT_LT((arm.inertia.about_com_kg_m2.diagonal() - Vector3d(0.03, 0.02, 0.04)).norm(), 1e-9);
  EXPECT_EQ(tree.mass_kg(), 3.5);
  EXPECT_EQ(tree.moved(tree.require_joint("slide")).type, JointType::prismatic);
  EXPECT_EQ(tree.moved(2).upper, std::numeric_limits<double>::infinity());  // continuous
  EXPECT_EQ(tree.link(tree.require_link("tip")).dof, -1);
  EXPECT_TRUE(tree.carries(tree.find_link("arm"), tree.find_link("tip")));
  EXPECT_FALSE(tree.carries(tree.find_link("rod"), tree.find_link("arm")));
  EXPECT_EQ(tree.find_joint("tip_frame"), -1);
  EXPECT_THROW(tree.require_link("leg"), ConfigError);
  EXPECT_THROW(tree.require_joint("tip_frame"), ConfigError);
}

std::string refusal_of_urdf(const std::string& urdf) {
  return testing::refusal([&] { read_urdf(write_urdf(urdf), UrdfUse::dynamics); });
}

TEST(RobotTree, RefusesWhatIsNoRobotInOneLineThatNamesIt) {
  const std::vector<std::tuple<std::string, std::string, std::string>> cases = {
      {"lower=\"-1\"", "lower=\"2.5\"", "joint 'shoulder'"},     // empty range
      {"velocity=\"3\"", "velocity=\"0\"", "joint 'shoulder'"},  // never moves
      {"velocity=\"3\"", "", "shoulder"},                        // missing
      {"axis xyz=\"3 0 4\"", "axis xyz=\"0 0 0\"", "joint 'shoulder'"},
      {"axis xyz=\"3 0 4\"", "axis xyz=\"3 0\"", "shoulder"},
      {"type=\"prismatic\"", "type=\"planar\"", "joint 'slide'"},
      {"type=\"prismatic\"", "type=\"bent\"", "slide"},
      {"mass value=\"2\"", "mass value=\"-2\"", "link 'arm'"},
      {"ixx=\"0.02\"", "ixx=\"0.2\"", "link 'arm'"},  // inertia of no real body
      {"ixx=\"0.02\"", "ixx=\"nan\"", "arm"},
      {"lower=\"-1\"", "lower=\"nan\"", "shoulder"},
      {"<child link=\"rod\"/>", "<child link=\"rot\"/>", "slide"},
      {"<parent link=\"arm\"/>", "<parent link=\"tip\"/>", "link 'rod'"},  // a loop
      {"<robot name=\"small\">", "", ""},
  };
  EXPECT_EQ(refusal_of_urdf(kSmallRobot), "");
  for (const auto& [was, is, named] : cases) {
    std::string urdf = kSmallRobot;
    const auto at = urdf.find(was);
    ASSERT_NE(at, std::string::npos) << was;
    urdf.replace(at, was.size(), is);
    const std::string why = refusal_of_urdf(urdf);
    EXPECT_NE(why.find("small.urdf: "), std::string::npos) << is << ": " << why;
    EXPECT_NE(why.find(named), std::string::npos) << is << ": " << why;
    EXPECT_NE(why.find("expected"), std::string::npos) << is << ": " << why;
    EXPECT_EQ(why.find('\n'), std::string::npos) << why;
  }
  for (const char* text : {"", "not XML", "<robot name=\"x\"/>", "<robot"}) {
    EXPECT_NE(refusal_of_urdf(text), "") << text;
  }
  EXPECT_THROW(read_urdf("/nowhere/robot.urdf"), ConfigError);
}

/// A planner needs no masses, nor speeds of joints that it does not move.
TEST(RobotTree, KinematicsNeedNeitherMassesNorSpeeds) {
  for (const auto& [was, is] : {std::pair("velocity=\"3\"", "velocity=\"0\""),
                                {"mass value=\"2\"", "mass value=\"-2\""},
                                {"ixx=\"0.02\"", "ixx=\"0.2\""}}) {
    std::string urdf = kSmallRobot;
    urdf.replace(urdf.find(was), std::string(was).size(), is);
    EXPECT_EQ(testing::refusal([&] { read_urdf(write_urdf(urdf)); }), "") << is;
  }
}

/// urdfdom gives back what it could read of a link: its geometry would be gone without a word.
TEST(RobotTree, RefusesALinkOfWhichAPartCannotBeRead) {
  for (const char* part :
       {"<collision><geometry><mesh filename='a.stl' scale='0.001'/></geometry></collision>",
        "<collision><geometry><capsule radius='0.1' length='1'/></geometry></collision>",
        "<collision><geometry/></collision>",
        "<visual><geometry><box size='1 1'/></geometry></visual>",
        "<visual><geometry><cylinder radius='1,5' length='2'/></geometry></visual>",
        "<collision><origin xyz='0 0'/><geometry><sphere radius='1'/></geometry></collision>",
        "<inertial><mass value='x'/></inertial>"}) {
    std::string urdf = kSmallRobot;
    const std::string head = "<link name=\"tip\">";
    const auto at = urdf.find("<link name=\"tip\"/>");
    ASSERT_NE(at, std::string::npos);
    urdf.replace(at, head.size() + 1, head + part + "</link>");
    const std::string why = testing::refusal([&] { read_urdf(write_urdf(urdf)); });
    EXPECT_NE(why.find("[tip]"), std::string::npos) << part << ": " << why;
  }
}

TEST(RobotTree, NamesXacro) {
  for (const char* part : {"<xacro:include filename='arm.xacro'/>", "<xacro:arm parent='base'/>",
                           "<link name='${prefix}base'/>"}) {
    std::string urdf = kSmallRobot;
    urdf.replace(urdf.find("</robot>"), 0, part);
    const std::string why = testing::refusal([&] { read_urdf(write_urdf(urdf)); });
    EXPECT_NE(why.find("is xacro, expected the URDF that"), std::string::npos) << part << why;
    urdf = kSmallRobot;
    urdf.replace(urdf.find("</robot>"), 0, "<!-- " + std::string(part) + " -->");
    EXPECT_EQ(testing::refusal([&] { read_urdf(write_urdf(urdf)); }), "") << "a comment";
  }
}

TEST(RobotTree, RefusesLinksOutOfOrder) {
  Link root, child;
  root.name = "root";
  child.name = "child";
  child.joint = "joint";
  child.parent = 1;
  EXPECT_THROW(RobotTree("r", {root, child}), ConfigError);
  child.parent = 0;
  EXPECT_NO_THROW(RobotTree("r", {root, child}));
  child.name = "root";
  EXPECT_THROW(RobotTree("r", {root, child}), ConfigError);
  EXPECT_THROW(RobotTree("r", {}), ConfigError);
}

TEST(Biped, HasThePublishedSizes) {
  const RobotTree tree = read_urdf(std::string(MIMESIS_SOURCE_DIR) + "/models/biped.urdf");
  EXPECT_EQ(tree.dof(), 30);
  EXPECT_NEAR(tree.mass_kg(), 58.0, 1e-9);
  EXPECT_EQ(tree.link(0).name, "pelvis");
  const Link& yaw = tree.moved(tree.require_joint("right_hip_yaw"));
  EXPECT_NEAR(yaw.lower, -30 * kDegree, 1e-4);
  EXPECT_NEAR(yaw.upper, 45 * kDegree, 1e-4);
  for (const std::string part : {"hip_roll", "hip_yaw", "ankle_roll", "shoulder_roll"}) {
    const Link& left = tree.moved(tree.require_joint("left_" + part));
    const Link& right = tree.moved(tree.require_joint("right_" + part));
    EXPECT_NEAR(left.lower, -right.upper, 1e-12) << part;  // mirrored
    EXPECT_NEAR(left.upper, -right.lower, 1e-12) << part;
  }
}

}  // namespace
}  // namespace mimesis::robot
