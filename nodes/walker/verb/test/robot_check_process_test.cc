// `mimesis robot check`: from a URDF to a file that the walker reads, or to what is missing.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/model/files.h"
#include "common/robot/leg_ik.h"
#include "common/shared_data.h"
#include "common/testing/process.h"
#include "common/testing/temporary_folder.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;

class RobotCheck : public testing::VerbTest {
 protected:
  int check(const fs::path& urdf, std::vector<std::string> more = {}) {
    std::vector<std::string> words{"robot", "check", urdf.string()};
    words.insert(words.end(), more.begin(), more.end());
    return call(words, std::chrono::seconds(120));
  }
  /// models/biped.urdf with some text replaced.
  fs::path changed(const std::string& from, const std::string& to) {
    std::stringstream text;
    text << std::ifstream(std::string(MIMESIS_SOURCE_DIR) + "/models/biped.urdf").rdbuf();
    std::string urdf = text.str();
    const auto at = urdf.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    urdf.replace(at, from.size(), to);
    std::ofstream(folder_ / "robot.urdf") << urdf;
    return folder_ / "robot.urdf";
  }
  testing::TemporaryFolder folder_;
};

TEST_F(RobotCheck, WritesAFileThatTheWalkerReads) {
  ASSERT_EQ(check(changed("<robot", "<robot"), {"-o", folder_.path(), "--name", "mine"}), 0)
      << errors_;
  EXPECT_NE(output_.find("found    gait: 0.35 m/s forward"), std::string::npos) << output_;
  const robot::Biped biped = model::load_biped((folder_ / "mine.yaml").string());
  EXPECT_NEAR(biped.feet_distance_m, 0.19, 1e-9);
  EXPECT_NEAR(biped.leg[robot::kLeft].max_S_m.y() - biped.leg[robot::kLeft].min_S_m.y(), 0.131,
              1e-6);
  EXPECT_NEAR(biped.gait.most_forward_m_s, 0.351, 1e-3);
  EXPECT_EQ(check(folder_ / "robot.urdf", {"-o", folder_.path(), "--name", "mine"}), 2);
  EXPECT_NE(errors_.find("--force"), std::string::npos) << "no file is replaced unasked";
}

TEST_F(RobotCheck, SaysWhatIsMissingAndNeverAborts) {
  EXPECT_EQ(
      check(changed("name=\"left_knee\" type=\"revolute\"", "name=\"left_knee\" type=\"fixed\"")),
      1);
  EXPECT_NE(output_.find("missing  left leg: 5 joints"), std::string::npos) << output_;
  EXPECT_EQ(check(folder_ / "none.urdf"), 2);
  EXPECT_EQ(check(changed("</robot>", "")), 2);
  EXPECT_EQ(check(changed("<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 1 0\"/><mimic joint=\"none\"/>")),
            2)
      << output_;
  std::ofstream(folder_ / "one.urdf") << "<robot name='one'><link name='only'/></robot>";
  EXPECT_EQ(check(folder_ / "one.urdf", {"--json"}), 1);
  const auto said = nlohmann::json::parse(output_);
  EXPECT_EQ(said["walks"], false);
  EXPECT_EQ(said["findings"][0]["kind"], "missing");
  EXPECT_EQ(said["findings"][0]["part"], "left leg");
}

/// As published: G1's ankles do not meet, TALOS has <mimic> and links without inertia.
TEST_F(RobotCheck, PublicRobotsNeedNoEdit) {
  const fs::path robots = shared_data("data/robots/public");
  const struct {
    const char* urdf;
    bool closed_form;
    double mass_kg;
  } cases[] = {
      {"g1/g1_29dof_rev_1_0.urdf", false, 33.34},
      {"example-robot-data/robots/talos_data/robots/talos_full_v2.urdf", true, 93.34},
  };
  int there = 0;
  for (const auto& [urdf, closed_form, mass_kg] : cases) {
    if (!fs::exists(robots / urdf)) continue;
    ++there;
    ASSERT_EQ(check(robots / urdf, {"-o", folder_.path(), "--name", "public", "--force"}), 0)
        << output_ << errors_;
    const robot::Biped biped = model::load_biped((folder_ / "public.yaml").string());
    EXPECT_NEAR(biped.tree.mass_kg(), mass_kg, 0.01);
    EXPECT_EQ(robot::LegIk(biped, robot::kLeft).closed_form(), closed_form);
  }
  if (there == 0) GTEST_SKIP() << "not here: needs data/robots/public of the shared folder";
}

}  // namespace
}  // namespace mimesis::tool
