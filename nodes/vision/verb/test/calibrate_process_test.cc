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
#include "common/testing/refusal.h"
#include "common/testing/temporary_folder.h"
#include "nodes/vision/calibration/testing/board_scene.h"
#include "nodes/vision/verb/calibration_pictures.h"

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

/// Empty files: only their names count.
std::vector<NamedPictures> paired(const fs::path& root, const std::vector<std::string>& from,
                                  const std::vector<std::string>& files,
                                  std::vector<vision::Rejected>& rejected) {
  fs::remove_all(root);
  for (const std::string& file : files) {
    fs::create_directories((root / file).parent_path());
    std::ofstream(root / file) << "";
  }
  std::vector<std::string> paths;
  for (const std::string& each : from) paths.push_back((root / each).string());
  return pictures_by_name(paths, rejected);
}

TEST(PicturesByName, FindPartnersByTheNamesThatPeopleGive) {
  const testing::TemporaryFolder folder;
  struct Case {
    std::vector<std::string> from, files;
  };
  const std::vector<Case> cases{
      {{"left", "right"},
       {"left/left1.jpg", "left/left2.jpg", "right/right1.jpg", "right/right2.jpg"}},
      {{"left", "right"}, {"left07.png", "left08.png", "right07.png", "right08.png"}},
      {{"left", "right"},
       {"left/left01.jpg", "left/left10.jpg", "right/right1.jpg", "right/right10.jpg"}},
      {{"cam0", "cam1"}, {"cam0/140.png", "cam0/150.png", "cam1/140.png", "cam1/150.png"}},
      {{"cam0", "cam1"},
       {"cam0/cam0_1.png", "cam0/cam0_2.png", "cam1/cam1_1.png", "cam1/cam1_2.png"}},
      {{"", ""}, {"1_l.png", "2_l.png", "1_r.png", "2_r.png"}},
      {{"", ""}, {"shot1-left.jpeg", "shot2-left.jpeg", "shot1-right.jpeg", "shot2-right.jpeg"}},
      {{"L", "R"}, {"L/imgLeft001.PNG", "L/imgLeft002.PNG", "R/imgRight1.PNG", "R/imgRight2.PNG"}},
      {{"a", "b"}, {"a/webcam 1.png", "a/webcam 2.png", "b/phone_0001.png", "b/phone_0002.png"}}};
  for (const Case& c : cases) {
    std::vector<vision::Rejected> rejected;
    const auto named = paired(folder / "pairs", c.from, c.files, rejected);
    ASSERT_EQ(named.size(), 2u);
    EXPECT_TRUE(rejected.empty()) << c.files[0] << ": " << rejected[0].reason;
    ASSERT_EQ(named[0].size(), 2u) << c.files[0];
    int first = 0;
    for (const auto& [name, file] : named[0]) {
      ASSERT_TRUE(named[1].contains(name)) << file;
      // The k-th of the one camera with the k-th of the other.
      EXPECT_EQ(file.filename(), fs::path(c.files[static_cast<std::size_t>(first)]).filename());
      EXPECT_EQ(named[1].at(name).filename(),
                fs::path(c.files[static_cast<std::size_t>(first) + 2]).filename());
      ++first;
    }
  }
}

TEST(PicturesByName, SayWhyThereIsNoPartner) {
  const testing::TemporaryFolder folder;
  std::vector<vision::Rejected> rejected;
  paired(folder / "pairs", {"left", "right"},
         {"left/left1.jpg", "left/left2.jpg", "right/right1.jpg", "right/right7.jpg"}, rejected);
  ASSERT_EQ(rejected.size(), 2u);
  EXPECT_NE(rejected[0].reason.find("left2.jpg has no partner: of the other camera's 2 pictures, "
                                    "right1.jpg to right7.jpg, none differs from its name in the "
                                    "side alone"),
            std::string::npos)
      << rejected[0].reason;
  rejected.clear();
  paired(folder / "pairs", {"left", "right"},
         {"left/left1.jpg", "left/left01.jpg", "right/right1.jpg"}, rejected);
  ASSERT_EQ(rejected.size(), 1u);
  EXPECT_NE(rejected[0].reason.find("are one picture by their names"), std::string::npos)
      << rejected[0].reason;
  EXPECT_NE(testing::refusal([&] {
              paired(folder / "pairs", {"", ""}, {"a1.png", "a2.png"}, rejected);
            }).find("none has 'left' in its name"),
            std::string::npos);
}

TEST_F(Calibrate, PicturesThatWereScaledAreRefusedWithAdvice) {
  const fs::path odd = folder_ / "odd", flat = folder_ / "flat";
  fs::create_directory(odd);
  fs::create_directory(flat);
  for (int i = 0; i < kPositions; ++i) {
    const auto picture = image::read_image(file("left", i));
    ASSERT_TRUE(picture);
    // Every second row is left out.
    image::Image half(picture->width, picture->height / 2);
    for (int v = 0; v < half.height; ++v)
      std::copy_n(picture->at(0, 2 * v), 3 * half.width, half.at(0, v));
    ASSERT_TRUE(image::write_png(flat / ("p" + std::to_string(i) + ".png"), half));
    ASSERT_TRUE(
        image::write_png(odd / ("p" + std::to_string(i) + ".png"), i == 0 ? half : *picture));
  }
  EXPECT_EQ(run({"mono", flat.string(), "--board", "8x5", "--square-m", "0.03"}), 1);
  EXPECT_NE(errors_.find("scaled to 640x240, unlike across and down; give them as the camera took"),
            std::string::npos)
      << errors_;
  EXPECT_EQ(run({"mono", odd.string(), "--board", "8x5", "--square-m", "0.03"}), 0) << errors_;
  EXPECT_NE(output_.find("has 640x240 pixels, most of this camera's 640x480"), std::string::npos)
      << output_;
}

/// The search for a board that is not there is long: it ends with a line, soon.
TEST_F(Calibrate, AnInvertedBoardAndNoneAreRefusedSoon) {
  const fs::path inverted = folder_ / "inverted", none = folder_ / "none";
  fs::create_directory(inverted);
  fs::create_directory(none);
  for (int i = 0; i < 24; ++i) {
    auto picture = image::read_image(file("left", i % kPositions));
    ASSERT_TRUE(picture);
    for (std::uint8_t& value : picture->bgr) value = static_cast<std::uint8_t>(255 - value);
    const std::string name = "p" + std::to_string(10 + i) + ".png";
    ASSERT_TRUE(image::write_png(inverted / name, *picture));
    std::ranges::fill(picture->bgr, std::uint8_t{120});
    ASSERT_TRUE(image::write_png(none / name, *picture));
  }
  EXPECT_EQ(run({"mono", inverted.string(), "--board", "8x5", "--square-m", "0.03"}), 2);
  EXPECT_NE(errors_.find("shows it inverted, white for black"), std::string::npos) << errors_;
  EXPECT_EQ(run({"mono", none.string(), "--board", "8x5", "--square-m", "0.03"}), 2);
  EXPECT_NE(errors_.find("board: no whole one of 8x5 inner corners in the first 10 pictures"),
            std::string::npos)
      << errors_;
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
