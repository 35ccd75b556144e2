#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/error.h"
#include "common/model/files.h"
#include "common/model/test/model_texts.h"
#include "common/robot/kinematics.h"
#include "common/shared_data.h"
#include "common/testing/refusal.h"
#include "common/testing/temporary_folder.h"

namespace mimesis::model {
namespace {

using Eigen::Vector3d;

/// Error of load_biped with `from` replaced by `to` in `file`; empty: none.
std::string refusal(const std::string& from, const std::string& to,
                    const std::string& file = "biped.yaml") {
  std::string text = slurp(kModels + file);
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  const testing::TemporaryFolder folder;
  for (const std::string name : {"biped.urdf", "biped.yaml"})
    std::filesystem::copy(kModels + name, folder.path());
  std::ofstream(folder / file) << text;
  return testing::refusal([&] { (void)load_biped(folder / "biped.yaml"); });
}

TEST(BipedFile, BipedStandsAsPublished) {
  const robot::Biped biped = load_biped("biped.yaml");  // found in models/
  EXPECT_EQ(biped.tree.dof(), 30);
  EXPECT_NEAR(biped.X_WB_half_sitting.translation().z(), 0.648702, 1e-6);
  EXPECT_NEAR(biped.X_WB_half_sitting.translation().x(), -0.00949, 1e-5);
  EXPECT_NEAR(biped.feet_distance_m, 0.19, 1e-12);
  EXPECT_NEAR(biped.com_height_m, 0.807, 1e-3);
  EXPECT_EQ(biped.upper_body.size(), 18u);
  for (const robot::Side side : robot::kSides) {
    EXPECT_LT((biped.leg[side].ankle_S_m - Vector3d(0.0, 0.0, 0.105)).norm(), 1e-12);
    EXPECT_EQ(biped.tree.link(biped.leg[side].foot).name,
              side == robot::kLeft ? "left_foot" : "right_foot");
    EXPECT_EQ(biped.tree.moved(biped.leg[side].dof[3]).joint,
              side == robot::kLeft ? "left_knee" : "right_knee");
  }
  EXPECT_EQ(biped.leg[robot::kLeft].max_S_m, Eigen::Vector2d(0.13, 0.075));
  EXPECT_EQ(biped.leg[robot::kRight].max_S_m, Eigen::Vector2d(0.13, 0.056));
  EXPECT_EQ(biped.leg[robot::kRight].min_S_m, Eigen::Vector2d(-0.1, -0.075));
  EXPECT_EQ(biped.tree.link(biped.trunk).name, "chest");
  EXPECT_EQ(urdf_of_biped("biped.yaml"), kModels + "biped.urdf");
}

TEST(BipedFile, Jvrc1StandsAsWell) {
  if (!std::filesystem::exists(shared_data("data/robots/jvrc1.urdf"))) {
    GTEST_SKIP() << "not here: needs data/robots/jvrc1.urdf of the shared folder";
  }
  const robot::Biped biped = load_biped("jvrc1.yaml");
  EXPECT_EQ(biped.tree.dof(), 34) << "44 joints, of which ten follow others by a gear";
  EXPECT_EQ(biped.upper_body.size(), 22u);
  EXPECT_EQ(biped.tree.moved(biped.leg[robot::kRight].dof[0]).joint, "R_HIP_P");
  EXPECT_LT((biped.leg[robot::kRight].ankle_S_m - Vector3d(0.0, 0.0, 0.1)).norm(), 1e-9);
  EXPECT_NEAR(biped.feet_distance_m, 0.192, 1e-9);
  robot::Kinematics kinematics(biped.tree);
  kinematics.update(biped.X_WB_half_sitting, biped.half_sitting);
  EXPECT_NEAR(kinematics.com().z(), biped.com_height_m, 1e-12);
  for (const robot::Side side : robot::kSides) {
    EXPECT_NEAR(kinematics.X_WL(biped.leg[side].sole).translation().z(), 0.0, 1e-12);
    EXPECT_NEAR(kinematics.X_WL(biped.leg[side].sole).translation().x(), 0.0, 1e-12);
  }
  EXPECT_NEAR(kinematics.com().x(), 0.01, 0.005);  // above the soles
}

TEST(BipedFile, EveryLinkThatMovesHasAMass) {
  const std::string chest = slurp(kModels + "biped.urdf");
  const std::size_t link = chest.find("<link name=\"chest\">"), end = chest.find("</link>", link);
  const std::string whole = chest.substr(link, end - link);
  EXPECT_TRUE(
      refusal(whole, "<link name=\"chest\">", "biped.urdf")
          .ends_with(
              "biped.yaml: link 'chest' has no mass, expected one on every link that moves"));
}

TEST(BipedFile, SaysWhatIsWrongWithAFile) {
  const struct {
    const char *from, *to, *says;
  } cases[] = {
      {"urdf: biped.urdf", "urdf: none.urdf", "none.urdf"},
      {"urdf: biped.urdf", "urdf: shared:none.urdf", "MIMESIS_SHARED"},
      {"[left_sole, right_sole]", "[left_sole]", "soles"},
      {"[left_sole, right_sole]", "[left_grip, right_sole]", "left_grip"},
      {"[left_sole, right_sole]", "[right_sole, left_sole]", "left"},
      {"[left_sole, right_sole]", "[left_sole, left_sole]", "carries both"},
      {"trunk: chest", "trunk: breast", "breast"},
      {"imu: pelvis", "imu: nose", "nose"},
      {"left_knee, angle_rad: 0.87", "left_knee, angle_rad: -0.87", "left_knee"},
      {"left_knee, angle_rad: 0.87", "left_knee, angle_rad: 0.97", "turned"},
      {"joint: left_knee", "joint: knee", "knee"},
      {"back_m: -0.1", "back_m: 0", "back < 0"},
      {"imu: pelvis", "ium: pelvis", "ium"},
  };
  for (const auto& [from, to, says] : cases) {
    const std::string what = refusal(from, to);
    EXPECT_NE(what.find(says), std::string::npos) << to << ": " << what;
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
  }
  EXPECT_THROW(load_biped("nowhere.yaml"), ConfigError);
}

}  // namespace
}  // namespace mimesis::model
