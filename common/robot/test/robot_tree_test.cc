#include "common/robot/robot_tree.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "common/error.h"
#include "common/robot/dynamics.h"
#include "common/robot/kinematics.h"
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
  return testing::refusal([&] { read_urdf(write_urdf(urdf)).require_dynamics(); });
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
    EXPECT_NE(why.find("small"), std::string::npos) << is << ": " << why;
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
  for (const auto& [part, macro] : {std::pair("<xacro:include file='a.xacro'/>", "<xacro:include"),
                                    std::pair("<xacro:arm parent='base'/>", "<xacro:arm"),
                                    std::pair("<link name='${prefix}base'/>", "${prefix")}) {
    std::string urdf = kSmallRobot;
    urdf.replace(urdf.find("</robot>"), 0, part);
    const std::string why = testing::refusal([&] { read_urdf(write_urdf(urdf)); });
    EXPECT_NE(why.find("is xacro (line 29: " + std::string(macro) + "), expected the URDF that"),
              std::string::npos)
        << why;
    urdf = kSmallRobot;
    urdf.replace(urdf.find("</robot>"), 0, "<!-- " + std::string(part) + " -->");
    EXPECT_EQ(testing::refusal([&] { read_urdf(write_urdf(urdf)); }), "") << "a comment";
  }
}

/// What people have beside URDFs: MJCF, SDF, launch files with ${}, pictures.
TEST(RobotTree, NamesFilesOfOtherKinds) {
  const auto why = [](const std::string& text) {
    const std::string said = testing::refusal([&] { read_urdf(write_urdf(text)); });
    return said.substr(said.find(": ") + 2);
  };
  const std::string end = ", expected <robot>: a URDF file";
  EXPECT_EQ(why("<mujoco model=\"arm\"><worldbody/></mujoco>"), "holds <mujoco>" + end);
  EXPECT_EQ(why("\xEF\xBB\xBF<?xml version='1.0'?>\n<!-- <robot> -->\n<sdf\nversion='1.7'/>"),
            "holds <sdf>" + end);
  for (const char* text : {"robot: ${arg:robot}\n", "\x89PNG\r\n", "<?xml", "<!-- <robot/>"}) {
    EXPECT_EQ(why(text), "is no XML" + end) << text;
  }
  EXPECT_EQ(why("version https://git-lfs.github.com/spec/v1\noid sha256:a\nsize 9\n"),
            "is a pointer of Git LFS (git lfs pull)" + end);
  EXPECT_EQ(why("\xFF\xFE<"), "is UTF-16" + end);
  EXPECT_EQ(why("<!DOCTYPE robot [<!ENTITY a '1'>]><robot/>"), "holds <!DOCTYPE [>" + end);
  std::string latin = kSmallRobot;
  latin.replace(latin.find("small"), 5, "sm\xE5ll");
  EXPECT_EQ(why(latin), "is no UTF-8" + end);
  EXPECT_EQ(testing::refusal([] { read_urdf("/tmp"); }),
            "/tmp: Is a directory, expected a URDF file");
}

/// Blank lines before the declaration [isaac_sim_grasping#10], a document type, and inertials
/// without content, which SolidWorks' exporter writes [solidworks_urdf_exporter2#187].
TEST(RobotTree, TakesWhatEditorsAndExportersWrite) {
  std::string urdf = kSmallRobot;
  const auto at = urdf.find("<link name=\"tip\"/>");
  const std::string before = urdf.substr(0, at), behind = urdf.substr(at + 18);
  for (const char* inertial : {"<inertial/>", "<inertial />", "<inertial>\n  </inertial>"}) {
    urdf = before + "<link name=\"tip\">" + inertial + "</link>" + behind;
    EXPECT_EQ(read_urdf(write_urdf(urdf)).require_link("tip"),
              read_urdf(write_urdf(kSmallRobot)).require_link("tip"));
  }
  urdf = before + "<link name=\"tip\"><inertial><origin/></inertial></link>" + behind;
  EXPECT_NE(testing::refusal([&] { read_urdf(write_urdf(urdf)); }).find("[tip]"),
            std::string::npos);
  urdf = kSmallRobot;
  const std::string name = " name=\"small\"";
  urdf.replace(urdf.find(name), name.size(), " xmlns:name='x'");
  EXPECT_EQ(read_urdf(write_urdf(urdf)).name(), "robot") << "an exporter left it out";
  urdf = kSmallRobot;
  urdf.insert(urdf.find("<robot"), "<!DOCTYPE robot>\n");
  for (const std::string& text : {urdf, "\n\r\n" + std::string(kSmallRobot)})
    EXPECT_EQ(read_urdf(write_urdf(text)).dof(), read_urdf(write_urdf(kSmallRobot)).dof());
}

/// A gripper's joints that follow another have no drive of their own.
TEST(RobotTree, HoldsJointsAndThoseThatFollowOthers) {
  std::string urdf = kSmallRobot;
  const auto at = urdf.find("<child link=\"wheel\"/>");
  urdf.insert(at, "<mimic joint=\"slide\" multiplier=\"-2\" offset=\"0.5\"/>");
  const RobotTree tree = read_urdf(write_urdf(urdf));
  ASSERT_EQ(tree.dof(), 3);
  const RobotTree fewer = held(tree, {{"shoulder", 0.3}}, {{"slide", 0.1}});
  ASSERT_EQ(fewer.joint_names(), std::vector<std::string>{"slide"});
  Eigen::VectorXd q(3), one(1);
  q[tree.require_joint("shoulder")] = 0.3;
  one[0] = q[tree.require_joint("slide")] = 0.1;
  q[tree.require_joint("turn")] = 0.5 - 2.0 * 0.1;
  Kinematics all(tree), few(fewer);
  all.update(Eigen::Isometry3d::Identity(), q);
  few.update(Eigen::Isometry3d::Identity(), one);
  for (int l = 0; l < 5; ++l)
    EXPECT_LT((all.X_WL(l).matrix() - few.X_WL(l).matrix()).norm(), 1e-12) << tree.link(l).name;

  EXPECT_NE(testing::refusal([&] {
              held(tree, {{"shoulder", 2.5}});
            }).find("'shoulder' at 2.5"),
            std::string::npos);
  EXPECT_NE(testing::refusal([&] {
              held(tree, {{"elbow", 0.0}});
            }).find("elbow"),
            std::string::npos);
  urdf.insert(urdf.find("<child link=\"rod\"/>"), "<mimic joint=\"turn\"/>");
  const RobotTree circle = read_urdf(write_urdf(urdf));
  EXPECT_NE(testing::refusal([&] { held(circle, {}); }).find("follows itself"), std::string::npos);
}

/// Sensors and covers often are points of some mass, on links that move.
TEST(RobotTree, MassesOfFixedLinksGoToTheirCarriers) {
  std::string urdf = kSmallRobot;
  urdf.replace(urdf.find("<link name=\"tip\"/>"), 18,
               "<link name=\"tip\"><inertial><origin xyz=\"0.1 0 0\"/><mass value=\"0.25\"/>"
               "<inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/>"
               "</inertial></link>");
  const RobotTree tree = read_urdf(write_urdf(urdf)), whole = merged(tree);
  EXPECT_THROW(tree.require_dynamics(), ConfigError);
  whole.require_dynamics();
  EXPECT_EQ(whole.link(whole.require_link("tip")).inertia.mass_kg, 0.0);
  EXPECT_NEAR(whole.mass_kg(), tree.mass_kg(), 1e-12);
  std::vector<Body> one = bodies_of(tree), other = bodies_of(whole);
  ASSERT_EQ(one.size(), other.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_NEAR(one[i].mass, other[i].mass, 1e-12);
    EXPECT_LT((one[i].first - other[i].first).norm(), 1e-12);
    EXPECT_LT((one[i].inertia - other[i].inertia).norm(), 1e-12) << i;
  }
  urdf.replace(urdf.find("0.25"), 4, "-0.2");
  const RobotTree negative = read_urdf(write_urdf(urdf));
  EXPECT_NE(testing::refusal([&] { merged(negative); }).find("link 'tip': mass -0.2"),
            std::string::npos);
}

TEST(RobotTree, MomentsOfNoBodyAreRaisedToABodys) {
  std::vector<Link> links = read_urdf(write_urdf(kSmallRobot)).links();
  links[1].inertia.about_com_kg_m2 = Eigen::Vector3d(0.01, 0.02, 0.05).asDiagonal();
  std::vector<std::string> changed;
  const RobotTree tree = balanced(RobotTree("small", links), &changed);
  EXPECT_EQ(changed, std::vector<std::string>{links[1].name});
  const Eigen::Matrix3d wanted = Eigen::Vector3d(1.0 / 60.0, 1.0 / 30.0, 0.05).asDiagonal();
  EXPECT_LT((tree.link(1).inertia.about_com_kg_m2 - wanted).norm(), 1e-9);
  EXPECT_EQ(tree.link(0).inertia.about_com_kg_m2, links[0].inertia.about_com_kg_m2);
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
