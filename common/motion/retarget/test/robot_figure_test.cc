#include "common/motion/retarget/robot_figure.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "common/model/files.h"
#include "common/shared_data.h"
#include "common/testing/refusal.h"

namespace mimesis::retarget {
namespace {

using Eigen::Vector3d;
using Names = std::array<std::string, 2>;

TEST(FigureOf, TheBipedsPartsAreThoseOfItsNames) {
  const RobotFigure f = figure_of(model::load_biped("biped.yaml"));
  EXPECT_EQ(f.pelvis, "pelvis");
  EXPECT_EQ(f.spine, "waist");
  EXPECT_EQ(f.chest, "chest");
  EXPECT_EQ(f.neck, "neck");
  EXPECT_EQ(f.head, "head");
  EXPECT_EQ(f.hip, (Names{"left_thigh", "right_thigh"}));
  EXPECT_EQ(f.knee, (Names{"left_shank", "right_shank"}));
  EXPECT_EQ(f.ankle, (Names{"left_foot", "right_foot"}));
  EXPECT_EQ(f.shoulder, (Names{"left_upper_arm", "right_upper_arm"}));
  EXPECT_EQ(f.elbow, (Names{"left_forearm", "right_forearm"}));
  EXPECT_EQ(f.wrist, (Names{"left_hand", "right_hand"}));
  for (const std::size_t side : {0u, 1u}) {
    EXPECT_EQ(f.heel_m[side], Vector3d(-0.100, 0.0, -0.105));
    EXPECT_EQ(f.toe_m[side], Vector3d(0.130, 0.0, -0.105));
    EXPECT_EQ(f.hand_m[side], Vector3d(0.0, 0.0, -0.13));
  }
  EXPECT_EQ(f.start_rad.size(), 12u);  // three of a leg, three of an arm, no gripper
  EXPECT_DOUBLE_EQ(f.start_rad.at("left_knee"), 50.0 / 180.0 * M_PI);
  EXPECT_EQ(f.start_rad.count("left_gripper"), 0u);
}

TEST(FigureOf, JvrcsPartsComeFromItsDescription) {
  if (!std::filesystem::exists(shared_data("data/robots/jvrc1.urdf"))) {
    GTEST_SKIP() << "not here: needs data/robots/jvrc1.urdf of the shared folder";
  }
  const robot::Biped biped = model::load_biped("jvrc1.yaml");
  const RobotFigure f = figure_of(biped);
  EXPECT_EQ(f.pelvis, "PELVIS_S");  // fixed to the root
  EXPECT_EQ(f.spine, "WAIST_Y_S");
  EXPECT_EQ(f.chest, "WAIST_R_S");
  EXPECT_EQ(f.neck, "NECK_Y_S");
  EXPECT_EQ(f.head, "NECK_P_S");
  EXPECT_EQ(f.hip, (Names{"L_HIP_Y_S", "R_HIP_Y_S"}));
  EXPECT_EQ(f.ankle, (Names{"L_ANKLE_P_S", "R_ANKLE_P_S"}));
  EXPECT_EQ(f.shoulder, (Names{"L_SHOULDER_Y_S", "R_SHOULDER_Y_S"}));
  EXPECT_EQ(f.elbow, (Names{"L_ELBOW_P_S", "R_ELBOW_P_S"}));
  EXPECT_EQ(f.wrist, (Names{"L_WRIST_Y_S", "R_WRIST_Y_S"}));
  // the hand's point is the walker's
  const robot::Kinematics zero(biped.tree);
  const Vector3d hand = zero.X_WL(biped.tree.require_link(f.wrist[0])) * f.hand_m[0];
  EXPECT_LT((hand - zero.X_WL(biped.hand[robot::kLeft]).translation()).norm(), 1e-12);
  EXPECT_NEAR(f.hand_m[0].z(), -0.13, 1e-12);
}

std::string refusal(const robot::Biped& biped) {
  return testing::refusal([&] { (void)figure_of(biped); });
}

TEST(FigureOf, SaysWhatIsMissing) {
  const robot::Biped good = model::load_biped("biped.yaml");
  robot::Biped bad = good;
  bad.head = -1;
  EXPECT_NE(refusal(bad).find("head: none"), std::string::npos);
  bad.head = bad.tree.require_link("left_hand");  // it is on the trunk: a strange head, but one
  EXPECT_EQ(refusal(bad), "");
  bad.head = bad.tree.require_link("left_foot");
  EXPECT_NE(refusal(bad).find("left_foot"), std::string::npos);
  bad = good;
  bad.trunk = 0;
  EXPECT_NE(refusal(bad).find("trunk"), std::string::npos);
  bad = good;
  bad.hand[robot::kRight] = -1;
  EXPECT_NE(refusal(bad).find("no right hand"), std::string::npos);
  std::vector<robot::Link> links = good.tree.links();
  robot::Link& elbow = links[static_cast<std::size_t>(good.tree.require_link("right_forearm"))];
  elbow.X_PJ.linear() = Eigen::AngleAxisd(0.1, Vector3d::UnitX()).toRotationMatrix();
  bad = good;
  bad.tree = robot::RobotTree("bent", links);
  EXPECT_NE(refusal(bad).find("'right_forearm' is turned"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::retarget
