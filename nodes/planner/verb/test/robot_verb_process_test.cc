// `mimesis robot new`: from a URDF to an arm that moves in simulation, by the commands it names.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/model/files.h"
#include "common/testing/process.h"
#include "common/testing/temporary_folder.h"
#include "nodes/planner/verb/verify_geometry.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

class RobotNew : public testing::VerbTest {
 protected:
  /// A base and five links, each on the one before; two fingers on the last, one follows the other.
  fs::path urdf(const std::string& third = "", const std::string& speed = "1.5") {
    const std::string shape =
        "<collision><origin xyz='0 0 0.1'/><geometry><cylinder radius='0.04' length='0.2'/>"
        "</geometry></collision>";
    std::ofstream out(folder_ / "my arm.urdf");
    out << "<robot name='my arm'>";
    for (int i = 0; i < 6; ++i)
      out << "<link name='link " << i << "'>" << (i == 3 && !third.empty() ? third : shape)
          << "</link>";
    for (const char* finger : {"left", "right"})
      out << "<link name='" << finger << "'><collision><geometry><box size='0.01 0.01 0.05'/>"
          << "</geometry></collision></link>";
    const auto joint = [&](const std::string& type, const std::string& from, const std::string& to,
                           const std::string& more) {
      out << "<joint name='to " << to << "' type='" << type << "'><parent link='" << from
          << "'/><child link='" << to << "'/><origin xyz='0 0 0.25'/>" << more << "</joint>";
    };
    for (int i = 0; i < 5; ++i)
      joint("revolute", "link " + std::to_string(i), "link " + std::to_string(i + 1),
            std::string("<axis xyz='") + (i % 2 == 0 ? "0 0 1" : "0 1 0") +
                "'/><limit lower='-2' upper='2' velocity='" + speed + "' effort='1'/>");
    const std::string slides =
        "<axis xyz='0 1 0'/><limit lower='0.01' upper='0.04' velocity='1' effort='1'/>";
    joint("prismatic", "link 5", "left", slides);
    joint("prismatic", "link 5", "right", slides + "<mimic joint='to left'/>");
    out << "</robot>";
    return folder_ / "my arm.urdf";
  }
  int make(std::vector<std::string> words) {
    words.insert(words.begin(), {"robot", "new"});
    words.insert(words.end(), {"--out", folder_.path()});
    if (std::ranges::count(words, "--name") == 0) words.insert(words.end(), {"--name", "mine"});
    return call(words);
  }
  static std::string text_of(const fs::path& file) {
    std::ostringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
  }
  std::string file() const { return folder_ / "mine.yaml"; }

  testing::TemporaryFolder folder_;
};

TEST_F(RobotNew, AnArmMovesByTheThreeCommands) {
  ASSERT_EQ(make({urdf()}), 0) << errors_;
  EXPECT_NE(output_.find("5 joints from link 0 to link 5"), std::string::npos) << output_;
  EXPECT_NE(output_.find("joint to left stays at 0.01"), std::string::npos);
  const kin::ArmModel arm = model::load_checked_arm(file()).arm;
  EXPECT_EQ(arm.dof(), 5);
  EXPECT_EQ(arm.a_max[0], 3.0) << "1.5 rad/s in half a second";
  EXPECT_TRUE(model::touching_groups(arm, arm.home).empty()) << "a plan can begin at home";
  EXPECT_TRUE(arm.unchecked.empty());

  const std::string text = text_of(folder_ / "mine.launch.yaml");
  EXPECT_NE(text.find("enable: {type: string, default: service"), std::string::npos)
      << "real drives wait for somebody who enables them";
  testing::TestGraph graph;
  testing::Process launch("mimesis",
                          {"launch", folder_ / "mine.launch.yaml", "--graph", graph.name(), "--arg",
                           "view=false", "--arg", "clock=lockstep"});
  testing::Process answer("mimesis", {"topic", "echo", "planner/answer", "--once", "--timeout",
                                      "60", "--graph", graph.name()});
  const std::vector<std::string> goal{
      "service", "call",      "planner/do", R"({"to": [{"position_rad": [1, 0.4, 0.3, 0.5, 0]}]})",
      "--graph", graph.name()};
  // Until all are ready, and the answer is heard.
  for (int asked = 0; asked < 60 && !answer.wait(1s); ++asked) call(goal);
  EXPECT_NE(answer.output().find("\"succeeded\": true"), std::string::npos)
      << answer.output() << answer.errors() << launch.errors();
  ASSERT_EQ(call({"topic", "echo", "bridge/joint_states", "--once", "--graph", graph.name()}), 0);
  EXPECT_NE(output_.find("1.00"), std::string::npos) << output_;
  launch.terminate();
}

/// Whoever leaves out a part, or changes the robot afterwards, gets no proof.
TEST_F(RobotNew, NothingIsProvenOfAnArmThatLacksAPart) {
  const fs::path robot = urdf();
  ASSERT_EQ(make({robot}), 0) << errors_;
  const std::string plan = folder_ / "plan.yaml";
  ASSERT_EQ(call({"plan", folder_ / "mine_table.yaml", "--robot", file(), "--goal",
                  "0.5,0.4,0.3,0.5,0.2", "-o", plan}),
            0)
      << errors_;
  EXPECT_EQ(call({"plan", "verify", plan}), 0) << output_ << errors_;
  std::vector<std::string> lines;
  std::ifstream in(file());
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  int parts = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].find("points_m") == std::string::npos) continue;
    ++parts;
    std::ofstream out(folder_ / "less.yaml");
    for (std::size_t k = 0; k < lines.size(); ++k)
      if (k != i) out << lines[k] << '\n';
    out.close();
    EXPECT_NE(call({"plan", "verify", plan, "--robot", folder_ / "less.yaml"}), 0) << lines[i];
    EXPECT_TRUE(output_.find("part or ball") != std::string::npos || !errors_.empty()) << output_;
  }
  EXPECT_EQ(parts, 8);
  urdf("<collision><geometry><cylinder radius='0.05' length='0.3'/></geometry></collision>");
  EXPECT_EQ(call({"plan", "verify", plan}), 1);
  EXPECT_NE(output_.find("link link 3: no part or ball holds its geometry at ("), std::string::npos)
      << output_;
}

TEST_F(RobotNew, TakesLinksAsTheyAreDrawnAndNamesThoseWithoutShape) {
  const std::string drawn = "<visual><geometry><box size='0.05 0.05 0.2'/></geometry></visual>";
  ASSERT_EQ(make({urdf(drawn)}), 0) << errors_;
  EXPECT_TRUE(model::load_checked_arm(file()).arm.unchecked.empty());
  const std::string heavy =
      "<inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>"
      "</inertial>";
  ASSERT_EQ(make({urdf(heavy), "--force"}), 0) << errors_;
  EXPECT_NE(output_.find("of no known shape, checked against nothing: link 3"), std::string::npos)
      << output_;
  EXPECT_EQ(model::load_checked_arm(file()).arm.unchecked, std::vector<std::string>{"link 3"});
}

/// A URDF that was made on another machine.
TEST_F(RobotNew, NamesOfMeshesAreMapped) {
  fs::create_directories(folder_ / "meshes");
  std::ofstream(folder_ / "meshes" / "t.stl")
      << "solid t\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0.1 0\nvertex 0.1 0 0\n"
         "endloop\nendfacet\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0.1 0 0\nvertex "
         "0 "
         "0 0.1\nendloop\nendfacet\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 0.1\n"
         "vertex 0 0.1 0\nendloop\nendfacet\nfacet normal 0 0 0\nouter loop\nvertex 0.1 0 "
         "0\nvertex 0 "
         "0.1 0\nvertex 0 0 0.1\nendloop\nendfacet\nendsolid t\n";
  const std::string file = urdf(
      "<collision><geometry><mesh filename='file:///home/other/ws/meshes/t.stl'/></geometry>"
      "</collision>");
  EXPECT_EQ(make({file}), 2);
  EXPECT_NE(errors_.find("mesh '/home/other/ws/meshes/t.stl' is not there"), std::string::npos);
  EXPECT_NE(errors_.find("or mesh_paths that say where"), std::string::npos) << errors_;
  EXPECT_EQ(make({file, "--mesh-path", "nothing"}), 2);
  EXPECT_NE(errors_.find("expected FROM=TO"), std::string::npos) << errors_;
  ASSERT_EQ(make({file, "--mesh-path", "file:///home/other/ws=" + folder_.path()}), 0) << errors_;
  const model::CoveredArm arm = model::load_covered_arm(this->file());
  EXPECT_EQ(arm.mesh_paths.front().second, fs::absolute(folder_.path()).string());
  const std::string scene = folder_ / "mine_table.yaml", plan = folder_ / "plan.yaml";
  ASSERT_EQ(call({"plan", scene, "--robot", this->file(), "--goal", "1,0.5,0,0.5,0", "-o", plan}),
            0)
      << errors_;
  EXPECT_EQ(call({"plan", "verify", plan}), 0) << output_ << errors_;
  for (const fs::path& changed : {fs::path(folder_.path()) / "meshes" / "t.stl", fs::path(file)}) {
    std::ofstream(changed, std::ios::app) << '\n';
    EXPECT_EQ(call({"plan", "verify", plan}), 1);
    EXPECT_NE(output_.find(changed.filename().string() + ": not as it was when this was planned"),
              std::string::npos)
        << output_;
  }
  fs::remove(folder_ / "meshes" / "t.stl");
  EXPECT_EQ(call({"plan", "verify", plan}), 1);
  EXPECT_NE(output_.find("link link 3: mesh "), std::string::npos) << output_;
}

/// As MoveIt's assistant writes it, and as hands do.
TEST_F(RobotNew, ReadsAnSrdf) {
  const auto srdf = [this](const std::string& text) {
    std::ofstream(folder_ / "my.srdf") << "<?xml version='1.0'?>\n<robot name='my arm'>\n"
                                       << text << "</robot>\n";
    return (folder_ / "my.srdf").string();
  };
  const std::string groups =
      "<group name='arm'><joint name='to link 1'/><joint name='to link 2'/><joint name='to link "
      "3'/>"
      "<joint name='to link 4'/></group>\n<group name='hand'><joint name='to left'/></group>\n"
      "<group name='all'><group name='arm'/><group name='hand'/></group>\n";
  const std::string states =
      "<group_state name='ready' group='arm'><joint name='to link 2' value='0.4'/>"
      "<joint name='to link 4' value='-0.7'/><joint name='to thumb' value='1'/></group_state>\n"
      "<group_state name='open' group='hand'><joint name='to left' value='0.03'/></group_state>\n";
  const std::string pairs =
      "<disable_collisions link1='link 3' link2='link 1' reason='Default'/>\n"
      "<disable_collisions link1='link 0' link2='link 3' reason='Never'/>\n"
      "<disable_collisions link1='camera' link2='link 3'/>\n";
  const std::string file = srdf(groups + states + pairs);
  ASSERT_EQ(make({urdf(), "--srdf", file, "--state", "ready", "--state", "open"}), 0) << errors_;
  EXPECT_NE(output_.find("4 joints from link 0 to link 4"), std::string::npos) << output_;
  EXPECT_NE(output_.find("joint to left stays at 0.03"), std::string::npos) << output_;
  EXPECT_NE(output_.find("link 3 and link 1 are not checked against each other, as the SRDF says "
                         "(Default)"),
            std::string::npos)
      << output_;
  EXPECT_NE(output_.find("a state places joint 'to thumb', which the robot lacks"),
            std::string::npos)
      << output_;
  const kin::ArmModel arm = model::load_checked_arm(this->file()).arm;
  EXPECT_EQ(std::vector<double>(arm.home.begin(), arm.home.end()),
            (std::vector<double>{0.0, 0.4, 0.0, -0.7}));
  const auto checked = [&](const std::string& a, const std::string& b) {
    return std::ranges::any_of(arm.self_pairs, [&](const std::pair<int, int>& p) {
      const std::string &x = arm.groups[static_cast<std::size_t>(p.first)],
                        &y = arm.groups[static_cast<std::size_t>(p.second)];
      return (x == a && y == b) || (x == b && y == a);
    });
  };
  EXPECT_FALSE(checked("link 1", "link 3"));
  EXPECT_TRUE(checked("link 0", "link 3")) << "said to touch never: checked";
  EXPECT_TRUE(checked("link 0", "link 4"));

  const auto refused = [&](const std::string& text, std::vector<std::string> more,
                           const std::string& what) {
    more.insert(more.begin(), {urdf(), "--force", "--srdf", srdf(text)});
    EXPECT_EQ(make(more), 2);
    EXPECT_NE(errors_.find(what), std::string::npos) << errors_ << "expected " << what;
  };
  refused(groups, {"--group", "leg"},
          "group 'leg' is no chain of joints, expected one of: arm, hand");
  refused(groups, {"--state", "up"}, "no state 'up'");
  refused("<group name='arm'><chain base_link='link 0' tip_link='flange'/></group>\n", {},
          "my.srdf:3: link 'flange', expected one of my arm");
  refused("<group name='arm'><joint name='to link 1'/><joint name='to lnk 2'/></group>\n", {},
          "my.srdf:3: joint 'to lnk 2', expected one of my arm");
  refused(groups + "<group name='other hand'><joint name='to thumb'/></group>\n",
          {"--group", "other hand"}, "joint 'to thumb', expected one of my arm");
  refused(groups + "<group name='two'><chain base_link='link 0' tip_link='link 5'/></group>\n", {},
          "expected --group, one of: arm, hand, two");
  refused("<group_state name='home'><joint name='to link 1' value='0,5'/></group_state>\n", {},
          "value '0,5', expected a number");
  refused("<xacro:include filename='arm.xacro'/>\n", {}, "is xacro");
  refused("<group name='arm'>\n", {}, "expected an SRDF");
}

/// Exporters write velocity="0", limits with fifteen digits, and boxes of no size for frames.
TEST_F(RobotNew, TakesWhatExportersWrite) {
  std::string text = text_of(urdf("", "0"));
  const auto swap = [&text](const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != text.npos; at += to.size())
      text.replace(at, from.size(), to);
  };
  swap("lower='-2'", "lower='1.1344640137963142'");
  swap("<link name='link 0'>",
       "<link name='link 0'><collision><geometry><box size='0 0 0'/>"
       "</geometry></collision>");
  swap("</robot>",
       "<link name='mark'><collision><geometry><box size='0 0 0'/></geometry></collision></link>"
       "<joint name='to mark' type='fixed'><parent link='link 5'/><child link='mark'/></joint>"
       "</robot> ");
  std::ofstream(folder_ / "my arm.urdf") << text;
  ASSERT_EQ(make({folder_ / "my arm.urdf", "--speed-rad-s", "0.7"}), 0) << errors_;
  EXPECT_NE(text_of(file()).find("v_max_rad_s: [0.7, 0.7, 0.7, 0.7, 0.7]"), std::string::npos);
  EXPECT_NE(text_of(file()).find("1.1344640137963142"), std::string::npos) << "home";
  const model::CoveredArm arm = model::load_covered_arm(file());
  EXPECT_EQ(arm.arm.v_max, Eigen::VectorXd::Constant(5, 0.7));
  EXPECT_EQ(geometry_gaps(arm), std::vector<std::string>{});
}

/// As on large arms of ABB and Fanuc: it moves beside the chain, with a joint of it.
TEST_F(RobotNew, ABalancerIsNamedAndMayBeLeftOut) {
  std::string text = text_of(urdf());
  text.replace(
      text.find("</robot>"), 8,
      "<link name='balancer'><collision><geometry><box size='0.1 0.1 0.1'/></geometry>"
      "</collision></link><joint name='to balancer' type='continuous'><parent link='link 1'"
      "/><child link='balancer'/><axis xyz='0 1 0'/><mimic joint='to link 2' "
      "multiplier='-0.25'/></joint></robot>");
  const std::string file_of_balancer = folder_ / "my arm.urdf";
  std::ofstream(file_of_balancer) << text;
  EXPECT_EQ(make({file_of_balancer}), 2);
  EXPECT_NE(errors_.find("link 'balancer' moves with 'to link 2' of the chain, by joint 'to "
                         "balancer': expected its name in without_geometry"),
            std::string::npos)
      << errors_;
  ASSERT_EQ(make({file_of_balancer, "--without-geometry", "balancer"}), 0) << errors_;
  EXPECT_NE(output_.find("checked against nothing: balancer"), std::string::npos) << output_;
  text = text_of(file());
  text.insert(text.find("    - {joint: "), "    - {joint: to balancer, at: 0}\n");
  std::ofstream(file()) << text;
  EXPECT_EQ(call({"plan", "arm", file()}), 2);
  EXPECT_NE(errors_.find("joint 'to balancer' moves with 'to link 2' of the chain"),
            std::string::npos)
      << errors_;
}

TEST_F(RobotNew, LeavesNothingBehindWhereItRefuses) {
  const auto expect = [this](const std::vector<std::string>& words, const std::string& said) {
    EXPECT_EQ(make(words), 2);
    EXPECT_NE(errors_.find(said), std::string::npos) << errors_;
  };
  expect({urdf("<collision><geometry><mesh filename='no.stl'/></geometry></collision>")},
         "link 'link 3': mesh 'no.stl'");
  expect({urdf("", "0")},
         "my arm.urdf: joint 'to link 1' has no limit of velocity (0), expected one above 0 and up "
         "to 100, or --speed-rad-s");
  expect({urdf("", "1e4")}, "joint 'to link 1' has no limit of velocity (10000)");
  expect({urdf(), "--name", "a b"}, "--name a b: expected letters, digits, _ and -");
  expect({urdf(), "--tip", "hand"}, "'hand'");
  expect({urdf(), "--home", "0,0"}, "my arm.urdf: chain: expected 5 numbers in home_rad");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1) << "the URDF alone";
  ASSERT_EQ(make({urdf()}), 0) << errors_;
  expect({urdf()}, "mine.yaml: is there already, expected a new --name, or --force");
}

}  // namespace
}  // namespace mimesis::tool
