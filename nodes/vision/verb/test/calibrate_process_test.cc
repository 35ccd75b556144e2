// `mimesis calibrate` as people call it: folders of rendered boards, a rig, its place on a table.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/image/image.h"
#include "common/model/rig_file.h"
#include "common/shared_data.h"
#include "common/testing/process.h"
#include "common/testing/temporary_folder.h"
#include "nodes/vision/calibration/testing/board_scene.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Pictures of a pair, rendered once for all tests: left00.png, right00.png, ...
class Calibrate : public testing::VerbTest {
 protected:
  static constexpr int kPositions = 6;

  static void SetUpTestSuite() {
    std::mt19937 random(909);
    pair_ = vision::random_pair(random);
    for (int i = 0; i < kPositions; ++i) {
      write_pair(i, vision::random_place(board_, pair_, random), random);
    }
  }

  static std::string file(const char* side, int i) {
    return (folder_ / (std::string(side) + std::to_string(i) + ".png")).string();
  }
  static void write_pair(int i, const Eigen::Isometry3d& place, std::mt19937& random) {
    ASSERT_TRUE(image::write_png(file("left", i),
                                 vision::board_picture(pair_[0], board_, place, 2.0, random)));
    ASSERT_TRUE(image::write_png(file("right", i),
                                 vision::board_picture(pair_[1], board_, place, 2.0, random)));
  }

  int run(std::vector<std::string> words) {
    words.insert(words.begin(), "calibrate");
    return call(words, std::chrono::seconds(100));
  }
  std::string at(const char* name) const { return (folder_ / name).string(); }

  static inline const vision::Board board_{8, 5, 0.03};
  static inline testing::TemporaryFolder folder_;
  static inline std::array<vision::TrueCamera, 2> pair_;
};

TEST_F(Calibrate, MakesARigAndPlacesItOnTheTable) {
  const std::string rig_file = at("rig.yaml");
  ASSERT_EQ(run({"stereo", at("left"), at("right"), "--board", "8x5", "--square-m", "0.03", "-o",
                 rig_file, "--json"}),
            0)
      << errors_;
  const json report = json::parse(output_);
  EXPECT_EQ(report["used"], kPositions);
  EXPECT_NEAR(report["baseline_m"].get<double>(), pair_[1].p_FC.norm(),
              0.02 * pair_[1].p_FC.norm());
  EXPECT_EQ(report["board"], "8x5 inner corners, squares of 30 mm");
  EXPECT_FALSE(report["advice"].empty());  // six positions are few
  EXPECT_LT(report["held_out"]["epipolar_px"].get<double>(), 0.5);
  const image::Rig rig = model::load_rig(rig_file);
  ASSERT_EQ(rig.cameras.size(), 2u);
  EXPECT_EQ(rig.cameras[1].name, "right");
  EXPECT_EQ(rig.frame, image::Rig::Frame::camera);

  // Any of the boards may lie on a table.
  ASSERT_EQ(run({"table", rig_file, file("left", 0), file("right", 0), "--board", "8x5",
                 "--square-m", "0.03", "-o", at("near.yaml")}),
            0)
      << errors_;
  ASSERT_EQ(run({"table", rig_file, file("left", 0), "--board", "8x5", "--square-m", "0.03",
                 "--side", "far", "-o", at("far.yaml")}),
            0)
      << errors_;
  const image::Rig near = model::load_rig(at("near.yaml")), far = model::load_rig(at("far.yaml"));
  EXPECT_EQ(near.frame, image::Rig::Frame::table);
  EXPECT_GT(near.cameras[0].camera.eye().y(), 0.2);  // above the table
  for (std::size_t i = 0; i < 2; ++i) {
    const Eigen::Vector3d &a = near.cameras[i].camera.eye(), &b = far.cameras[i].camera.eye();
    EXPECT_LT((a - Eigen::Vector3d(-b.x(), b.y(), -b.z())).norm(), 0.02 * a.norm());
  }
}

TEST_F(Calibrate, OneCameraOfAFolder) {
  const fs::path alone = folder_ / "alone";
  fs::create_directory(alone);
  for (int i = 0; i < kPositions; ++i)
    fs::copy(file("left", i), alone / ("p" + std::to_string(i) + ".png"));
  ASSERT_EQ(run({"mono", alone.string(), "--board", "8x5", "--square-m", "0.03", "--name", "head",
                 "-o", at("mono.yaml")}),
            0)
      << errors_;
  EXPECT_NE(output_.find("advice: take 12 positions"), std::string::npos) << output_;
  const image::Rig rig = model::load_rig(at("mono.yaml"));
  ASSERT_EQ(rig.cameras.size(), 1u);
  EXPECT_EQ(rig.cameras[0].name, "head");
  EXPECT_NEAR(rig.cameras[0].camera.lens().fx_px / pair_[0].fx, 1.0, 0.03);
}

TEST_F(Calibrate, MistakesAreToldInOneLine) {
  const std::string left = at("left"), right = at("right");
  EXPECT_EQ(run({"stereo", right, left, "--board", "8x5", "--square-m", "0.03"}), 1);
  EXPECT_NE(errors_.find("are the pictures swapped?"), std::string::npos) << errors_;
  const fs::path two = folder_ / "two";  // a search for what is not there takes long
  fs::create_directory(two);
  for (const int i : {0, 1}) fs::copy(file("left", i), two / fs::path(file("left", i)).filename());
  EXPECT_EQ(run({"mono", two.string(), "--board", "7x5", "--square-m", "0.03"}), 2);
  EXPECT_NE(errors_.find("shows 8x5 inner corners, not 7x5"), std::string::npos) << errors_;
  EXPECT_EQ(run({"stereo", left, right, "--board", "8by5", "--square-m", "0.03"}), 2);
  EXPECT_NE(errors_.find("expected the numbers of inner corners"), std::string::npos) << errors_;
  EXPECT_EQ(run({"stereo", left, right, "--board", "8x5"}), 2);
  EXPECT_NE(errors_.find("--square-m"), std::string::npos) << errors_;
  EXPECT_EQ(run({"stereo", left, at("middle"), "--board", "8x5", "--square-m", "0.03"}), 2);
  EXPECT_NE(errors_.find("no PNG or JPEG picture begins so"), std::string::npos) << errors_;
  EXPECT_EQ(run({"table", at("absent.yaml"), file("left", 0), "--square-m", "0.03"}), 2);
  EXPECT_NE(errors_.find("no such file"), std::string::npos) << errors_;
}

TEST_F(Calibrate, APictureWithoutPartnerIsNamed) {
  const fs::path some = folder_ / "some";
  fs::create_directory(some);
  for (int i = 0; i < kPositions; ++i) {
    for (const char* side : {"left", "right"}) {
      if (i == 2 && *side == 'r') continue;
      fs::copy(file(side, i), some / fs::path(file(side, i)).filename());
    }
  }
  ASSERT_EQ(run({"stereo", (some / "left").string(), (some / "right").string(), "--board", "8x5",
                 "--square-m", "0.03"}),
            0)
      << errors_;
  EXPECT_NE(output_.find("rejected 2: " + (some / "left2.png").string() + " has no partner"),
            std::string::npos)
      << output_;
}

TEST_F(Calibrate, TheRealPairs) {
  const auto folder = shared_data("vision/stereo_calibration");
  if (!fs::exists(folder)) GTEST_SKIP() << "not here: " << folder << " is absent";
  ASSERT_EQ(run({"stereo", (folder / "left").string(), (folder / "right").string(), "--square-m",
                 "0.025", "--json"}),
            0)
      << errors_;
  const json report = json::parse(output_);
  EXPECT_EQ(report["used"], 13);
  EXPECT_TRUE(report["rejected"].empty());
  EXPECT_LE(report["rms_px"].get<double>(), 0.22);
}

}  // namespace
}  // namespace mimesis::tool
