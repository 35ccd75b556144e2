// Arms whose convex parts are fitted to the geometry of a URDF.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/error.h"
#include "common/model/files.h"
#include "common/robot/kinematics.h"
#include "common/testing/temporary_folder.h"

namespace mimesis::model {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

const std::string kRod =
    "<collision><origin xyz='0 0 0.15' rpy='0.2 0 0'/><geometry><cylinder radius='0.05' "
    "length='0.3'/></geometry></collision>";

std::string mesh(const std::string& name, const std::string& more = "") {
  return "<collision><geometry><mesh filename='" + name + "' " + more + "/></geometry></collision>";
}

/// The corner of a cube: a tetrahedron with edges of 0.1 along the axes.
constexpr const char* kObj =
    "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
constexpr const char* kStl =
    "solid t\nfacet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 0.1 0\nvertex 0.1 0 0\n"
    "endloop\nendfacet\nfacet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 0.1 0 0\n"
    "vertex 0 0 0.1\nendloop\nendfacet\nfacet normal -1 0 0\nouter loop\nvertex 0 0 0\n"
    "vertex 0 0 0.1\nvertex 0 0.1 0\nendloop\nendfacet\nfacet normal 1 1 1\nouter loop\n"
    "vertex 0.1 0 0\nvertex 0 0.1 0\nvertex 0 0 0.1\nendloop\nendfacet\nendsolid t\n";
/// The same in millimetres, z up.
constexpr const char* kDae = R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.001" name="millimeter"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g" name="g"><mesh>
<source id="p"><float_array id="pa" count="12">0 0 0 100 0 0 0 100 0 0 0 100</float_array>
<technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/>
<p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>
)";

class FittedParts : public ::testing::Test {
 protected:
  FittedParts() { fs::create_directories(folder_ / "arm_description" / "urdf"); }

  fs::path urdf_folder() const { return folder_ / "arm_description" / "urdf"; }

  /// Links l0 to l4, each turned by a joint on top of the one before; `solids` of l2; a camera is
  /// fixed to l3, a finger turns on l4.
  std::string written(const std::string& solids, const std::string& chain = "",
                      const std::string& more = "", const std::string& finger = "") {
    std::ofstream out(urdf_folder() / "arm.urdf");
    out << "<robot name='arm'>";
    for (int i = 0; i < 5; ++i)
      out << "<link name='l" << i << "'>" << (i == 2 ? solids : kRod) << "</link>";
    out << "<link name='camera'>" << kRod << "</link><link name='finger'>" << finger << "</link>";
    const auto joint = [&](const char* type, const char* from, const char* to, const char* axis) {
      out << "<joint name='to_" << to << "' type='" << type << "'><parent link='" << from
          << "'/><child link='" << to << "'/><origin xyz='0 0.1 0.3' rpy='0 0.1 0'/><axis xyz='"
          << axis << "'/><limit lower='-2' upper='2' velocity='1' effort='1'/></joint>";
    };
    joint("revolute", "l0", "l1", "0 0 1");
    joint("revolute", "l1", "l2", "0 1 0");
    joint("revolute", "l2", "l3", "0 0 1");
    joint("revolute", "l3", "l4", "0 1 0");
    joint("fixed", "l3", "camera", "0 0 1");
    joint("revolute", "l4", "finger", "0 0 1");
    out << "</robot>";
    std::ofstream(urdf_folder() / "arm.yaml")
        << "name: arm\nchain: {urdf: arm.urdf, base: l0, tip: l4, a_max_rad_s2: [4, 4, 4, 4]"
        << chain << "}\n"
        << more;
    return urdf_folder() / "arm.yaml";
  }

  static std::string refusal(const std::string& file) {
    try {
      load_arm(file);
    } catch (const ConfigError& e) {
      const std::string message = e.what();
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      return message;
    }
    return "read";
  }

  /// The arm's parts from `first` on are those of the link at X_WL. @return the next link's
  static std::size_t expect_placed(const kin::ArmModel& arm, const CoveredLink& link,
                                   std::size_t first, const Eigen::VectorXd& q,
                                   const Eigen::Isometry3d& X_WL) {
    std::vector<Eigen::Isometry3d> X;
    kin::forward(arm, q, X);
    for (const math::ConvexPart& part : link.parts) {
      const kin::SafetyPart& own = arm.parts.at(first++);
      EXPECT_EQ(own.frame, link.frame);
      for (Eigen::Index i = 0; i < part.points.rows(); ++i) {
        const Vector3d there =
            X[static_cast<std::size_t>(own.frame)] * Vector3d(own.shape.points.row(i).transpose());
        EXPECT_LT((there - X_WL * Vector3d(part.points.row(i).transpose())).norm(), 1e-9);
      }
    }
    return first;
  }

  testing::TemporaryFolder folder_;
};

TEST_F(FittedParts, TouchingAtHomeAloneIsNoReasonNotToCheck) {
  const std::string board = "<collision><geometry><box size='0.3 0.3 0.9'/></geometry></collision>";
  const CoveredArm covered = load_covered_arm(written(board));
  const kin::ArmModel& arm = covered.arm;
  const Eigen::MatrixXd postures = sampled_postures(arm);
  std::string home;
  std::pair<int, int> touching;
  for (Eigen::Index p = 0; p < postures.cols() && home.empty(); ++p) {
    for (const auto& pair : touching_groups(arm, postures.col(p))) {
      if (std::ranges::count(arm.self_pairs, pair) == 0) continue;
      touching = pair;
      for (const double q : Eigen::VectorXd(postures.col(p)))
        home += (home.empty() ? "" : ", ") + std::to_string(q);
      break;
    }
  }
  ASSERT_FALSE(home.empty());
  const CoveredArm again = load_covered_arm(written(board, ", home_rad: [" + home + "]"));
  EXPECT_EQ(again.arm.self_pairs, arm.self_pairs);
  EXPECT_GT(std::ranges::count(again.arm.self_pairs, touching), 0);
}

TEST_F(FittedParts, EveryLinkWithGeometryIsAGroupInItsPlace) {
  const CoveredArm covered = load_covered_arm(written(kRod));
  const kin::ArmModel& arm = covered.arm;
  EXPECT_EQ(arm.groups, (std::vector<std::string>{"l0", "l1", "l2", "l3", "l4", "camera"}));
  EXPECT_EQ(arm.env_groups, (std::vector<int>{1, 2, 3, 4, 5})) << "all but the base";
  for (const auto& [a, b] : arm.self_pairs)
    EXPECT_GE(std::abs(covered.links[static_cast<std::size_t>(a)].frame -
                       covered.links[static_cast<std::size_t>(b)].frame),
              2);
  // Frames 0, 1, 2, 3, 4 and the camera's 3: eight pairs are two joints apart, or more.
  EXPECT_EQ(arm.self_pairs.size() + covered.always_touching.size(), 8u);

  const robot::RobotTree tree = robot::read_urdf(urdf_folder() / "arm.urdf");
  robot::Kinematics judge(tree);
  const Eigen::VectorXd q = Eigen::VectorXd::LinSpaced(5, -1.0, 1.5);  // the last one: the finger
  judge.update(Eigen::Isometry3d::Identity(), q);
  std::size_t next = 0;
  for (const CoveredLink& link : covered.links) {
    EXPECT_TRUE(link.fitted);
    ASSERT_TRUE(link.over);
    EXPECT_LE(link.over->reach_m, 0.002);
    EXPECT_EQ(link.over->bare_m3, 0.0);
    next = expect_placed(arm, link, next, q.head(4), judge.X_WL(tree.find_link(link.link)));
  }
  EXPECT_EQ(next, arm.parts.size());
}

TEST_F(FittedParts, StandBesideBallsByHand) {
  const CoveredArm covered = load_covered_arm(
      written(kRod, ", without_geometry: [l2, l3, camera, finger]",
              "groups: [a, b]\nobstacle_groups: [b]\nself_pairs: [{a: a, b: b}]\nballs:\n"
              "  - {link: l1, group: a, center_m: [0, 0, 0.1], radius_m: 0.1}\n"
              "  - {link: l1, group: a, center_m: [0, 0, 0.2], radius_m: 0.1}\n"
              "parts:\n  - {link: l4, group: b, fitted_m: 0.03}\n",
              kRod));
  ASSERT_EQ(covered.links.size(), 2u);
  EXPECT_FALSE(covered.links[0].fitted);
  EXPECT_EQ(covered.links[0].parts.size(), 2u);
  ASSERT_TRUE(covered.links[0].over);
  EXPECT_GT(covered.links[0].over->bare_m3, 0.0) << "two balls do not cover this rod";
  EXPECT_EQ(covered.links[1].over->bare_m3, 0.0);
  EXPECT_EQ(covered.arm.self_pairs, (std::vector<std::pair<int, int>>{{0, 1}}));
  EXPECT_EQ(covered.arm.unchecked, (std::vector<std::string>{"l2", "l3", "camera", "finger"}));
}

/// A part that moves and is checked against nothing would be proven by silence.
TEST_F(FittedParts, WhatIsNotCheckedIsRefusedUntilTheFileSaysSo) {
  const std::string seen =
      "<visual><geometry><cylinder radius='0.05' length='0.3'/></geometry></visual>";
  const std::string massive =
      "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' "
      "iyz='0'/></inertial>";
  const auto says = [](const std::string& message, const std::string& what) {
    EXPECT_NE(message.find(what), std::string::npos) << message;
  };
  says(refusal(written(seen)), "link 'l2' moves, and has visual, but no collision geometry");
  says(refusal(written(massive)), "link 'l2' moves, and has mass, but no geometry");
  EXPECT_EQ(refusal(written("")), "read") << "a frame";
  EXPECT_EQ(load_arm(written(seen, ", use_visual: true")).groups, load_arm(written(kRod)).groups);
  const kin::ArmModel excused = load_arm(written(seen, ", without_geometry: [l2]"));
  EXPECT_EQ(excused.unchecked, std::vector<std::string>{"l2"});
  EXPECT_TRUE(load_arm(written(kRod, ", without_geometry: [l2]")).unchecked.empty());
  says(refusal(written(kRod, ", without_geometry: [l9]")), "no link 'l9' that the chain moves");

  const std::string
      groups = "groups: [a, b]\n",
      few = "parts: [{link: l1, group: a, fitted_m: 0.03}, {link: l4, group: b, fitted_m: 0.03}]\n";
  const std::string obstacles = "obstacle_groups: [a, b]\n", pairs = "self_pairs: [{a: a, b: b}]\n";
  says(refusal(written(kRod, "", groups + few)), "obstacle_groups: there is none");
  says(refusal(written(kRod, "", groups + obstacles + few)), "self_pairs: there is none");
  says(refusal(written(kRod, "", groups + obstacles + pairs + few)),
       "none is on link 'l2' though it has geometry");
}

/// Fingers: where they stay is said, also of the one that follows the other.
TEST_F(FittedParts, JointsBesideTheChainStayWhereTheFileSays) {
  const CoveredArm covered =
      load_covered_arm(written(kRod, ", fixed: [{joint: to_finger, at: 0.5}]", "", kRod));
  EXPECT_EQ(covered.arm.groups.back(), "finger");
  const robot::RobotTree tree = robot::read_urdf(urdf_folder() / "arm.urdf");
  robot::Kinematics judge(tree);
  Eigen::VectorXd q = Eigen::VectorXd::LinSpaced(5, -1.0, 1.0);
  q[4] = 0.5;
  judge.update(Eigen::Isometry3d::Identity(), q);
  const CoveredLink& finger = covered.links.back();
  const std::size_t first = covered.arm.parts.size() - finger.parts.size();
  expect_placed(covered.arm, finger, first, q.head(4), judge.X_WL(tree.find_link("finger")));
  const auto says = [&](const std::string& fixed, const std::string& what) {
    const std::string why = refusal(written(kRod, ", fixed: [" + fixed + "]", "", kRod));
    EXPECT_NE(why.find(what), std::string::npos) << why;
  };
  says("{joint: to_finger, at: 2.5}", "within its limits");
  says("{joint: to_finger}", "at");
  says("{joint: to_l2, at: 0}", "is in the chain");
  says("{joint: nobody, at: 0}", "no joint 'nobody'");
}

TEST_F(FittedParts, MeshesOfAllFormatsAreTheSame) {
  fs::create_directories(folder_ / "arm_description" / "meshes");
  std::ofstream(folder_ / "arm_description" / "meshes" / "t.obj") << kObj;
  std::ofstream(urdf_folder() / "t.stl") << kStl;
  std::ofstream(urdf_folder() / "t.dae") << kDae;
  for (const std::string& name : {std::string("package://arm_description/meshes/t.obj"),
                                  std::string("t.stl"), std::string("t.dae")}) {
    SCOPED_TRACE(name);
    const CoveredArm covered = load_covered_arm(written(mesh(name)));
    const CoveredLink& link = covered.links[2];
    EXPECT_EQ(link.link, "l2");
    ASSERT_TRUE(link.over);
    EXPECT_NEAR(link.over->solid_m3, 1e-3 / 6.0, 0.03e-3 / 6.0);
    EXPECT_EQ(link.over->bare_m3, 0.0);
  }
  const CoveredArm larger = load_covered_arm(written(mesh("t.stl", "scale='2 -1 1'")));
  EXPECT_NEAR(larger.links[2].over->solid_m3, 2e-3 / 6.0, 0.06e-3 / 6.0) << "and mirrored";
}

/// Not even the base is left out in silence.
TEST_F(FittedParts, GeometryThatCannotBeReadIsSaidToBeUnchecked) {
  const std::string file = written(kRod, ", without_geometry: [l0]");
  std::stringstream text;
  text << std::ifstream(urdf_folder() / "arm.urdf").rdbuf();
  std::string urdf = text.str();
  urdf.replace(urdf.find(kRod), kRod.size(), mesh("none.stl"));
  std::ofstream(urdf_folder() / "arm.urdf") << urdf;
  EXPECT_EQ(load_arm(file).unchecked, std::vector<std::string>{"l0"});
}

/// Boxes of no size mark frames, balls of no size contact points.
TEST_F(FittedParts, MarksAreNoGeometry) {
  const std::string marks =
      "<collision><geometry><box size='0 0 0'/></geometry></collision><collision><geometry>"
      "<sphere radius='0'/></geometry></collision>";
  const kin::ArmModel with = load_arm(written(kRod + marks)), without = load_arm(written(kRod));
  EXPECT_EQ(with.parts.size(), without.parts.size());
  const std::string heavy =
      "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' "
      "ixz='0' iyz='0'/></inertial>";
  EXPECT_NE(refusal(written(heavy + marks)).find("link 'l2' moves, and has mass, but no geometry"),
            std::string::npos);
}

TEST_F(FittedParts, SaysWhatIsWrong) {
  std::ofstream(urdf_folder() / "t.stl") << kStl;
  std::ofstream(urdf_folder() / "points.obj") << "v 0 0 0\nv 1 0 0\np 1 2\n";
  std::ofstream(urdf_folder() / "nan.obj") << "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  std::ofstream(urdf_folder() / "t.xyz") << "nothing that is a mesh\n";
  std::ofstream(urdf_folder() / "torn.stl", std::ios::binary)
      << std::string(80, 'x') << "\x10\x27" << std::string(60, '\0');
  const auto says = [](const std::string& message, const std::string& what) {
    EXPECT_NE(message.find(what), std::string::npos) << message;
  };
  says(refusal(written(mesh("none.stl"))),
       "link 'l2': mesh 'none.stl' is not there, expected it at");
  says(refusal(written(mesh("package://nowhere/t.stl"))), ", or in $ROS_PACKAGE_PATH");
  std::ofstream(urdf_folder() / "lfs.stl")
      << "version https://git-lfs.github.com/spec/v1\noid sha256:8\n";
  says(refusal(written(mesh("lfs.stl"))), "is a pointer of Git LFS");
  std::ofstream(urdf_folder() / "empty.stl") << "solid x\nendsolid x\n";
  says(refusal(written(mesh("empty.stl"))), "empty.stl' has no triangles");
  std::ofstream(urdf_folder() / "header.stl")
      << std::string(80, '\0');  // Kinova's EndEffector_Link
  says(refusal(written(mesh("header.stl"))),
       "header.stl' has no triangles, expected some, or its name in without_geometry");
  EXPECT_EQ(refusal(written(mesh("header.stl"), ", without_geometry: [l2]")), "read");
  says(refusal(written(mesh("t.xyz"))), "expected STL, OBJ or Collada");
  says(refusal(written(mesh("torn.stl"))), "expected STL, OBJ or Collada");
  says(refusal(written(mesh("points.obj"))), "points.obj");
  says(refusal(written(mesh("nan.obj"))), "nan.obj");
  says(refusal(written(mesh("t.stl", "scale='0 1 1'"))), "scale of a mesh");
  says(refusal(written("<collision><geometry><box size='0.1 0 0.1'/></geometry></collision>")),
       "size of a box, expected lengths above 0");
  says(refusal(written("<collision><geometry><sphere radius='-1'/></geometry></collision>")),
       "radius of a sphere");
  says(refusal(written(kRod, "", "", kRod)),
       "link 'finger' moves on joint 'to_finger' beside the chain, expected {joint: to_finger");
  says(refusal(written(kRod, "", "groups: [a]\n")), "expected no groups");
  const std::string entry = "groups: [a]\nparts: [{link: l2, group: a, fitted_m: ";
  says(refusal(written("", "", entry + "0.02}]\n")), "link 'l2' has no collision geometry");
  says(refusal(written(kRod, "", entry + "0.0001}]\n")), "fitted_m, expected 0.001 .. 1");
  says(refusal(written(kRod, "", entry + "0.02, radius_m: 0.1}]\n")), "radius_m");
  says(refusal(written(kRod, "", "groups: [a]\nparts: [{link: l2, group: a, points_m: [0, 1]}]\n")),
       "parts[0]: 2 numbers in points_m, expected x y z of each point");
  says(refusal(written(kRod, ", most_parts: 0")), "most_parts: 0 is outside");
}

}  // namespace
}  // namespace mimesis::model
