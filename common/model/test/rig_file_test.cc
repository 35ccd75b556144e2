#include "common/model/rig_file.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdlib>
#include <fstream>
#include <random>

#include "common/error.h"
#include "common/testing/refusal.h"
#include "common/testing/temporary_folder.h"

namespace mimesis::model {
namespace {

image::Rig rig() {
  image::View view;
  const image::Camera left(view);
  view.eye_m[0] += 0.1;
  const image::Camera right(view);
  const image::Lens lens{640, 480, 533.5, 537.25, 342.0, 235.0, {-0.28, 0.06, 0.001, -0.0008, 0.0}};
  return {"2026-11-26",
          "9x6 inner corners, squares of 25 mm",
          image::Rig::Frame::table,
          13,
          0.127,
          {{"left", image::Camera(lens, left.R_CT(), left.eye()), 0.21},
           {"right", image::Camera(lens, right.R_CT(), right.eye()), 0.22}}};
}

class RigFile : public ::testing::Test {
 protected:
  std::string write(const std::string& text) {
    std::ofstream(folder_ / "rig.yaml", std::ios::binary) << text;
    return folder_ / "rig.yaml";
  }
  /// The reader's complaint without the folder, or "" if it takes the text.
  std::string complaint(const std::string& text) {
    try {
      load_rig(write(text));
    } catch (const ConfigError& e) {
      std::string what = e.what();
      const std::string folder = folder_.string() + "/";
      for (std::size_t at = what.find(folder); at != std::string::npos; at = what.find(folder))
        what.erase(at, folder.size());
      return what;
    }
    return {};
  }

  testing::TemporaryFolder folder_;
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST_F(RigFile, IsReadAsItWasWritten) {
  const image::Rig before = rig();
  const image::Rig after = load_rig(write(rig_text(before)));
  EXPECT_EQ(after.date, before.date);
  EXPECT_EQ(after.board, before.board);
  EXPECT_EQ(after.frame, before.frame);
  EXPECT_EQ(after.pictures, 13);
  EXPECT_EQ(after.epipolar_px, 0.127);
  ASSERT_EQ(after.cameras.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const image::RigCamera &a = after.cameras[i], &b = before.cameras[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.held_out_px, b.held_out_px);
    EXPECT_EQ(a.camera.eye(), b.camera.eye());
    EXPECT_LT((a.camera.R_CT() - b.camera.R_CT()).norm(), 1e-14);
    EXPECT_EQ(a.camera.lens().fx_px, b.camera.lens().fx_px);
    EXPECT_EQ(a.camera.lens().distortion, b.camera.lens().distortion);
    EXPECT_EQ(a.camera.width(), 640);
  }
}

TEST_F(RigFile, OfAnArmSaysHowWellItIsKnown) {
  image::Rig before = rig();
  before.position_2sigma_m = {1e-3, 2e-3, 3e-3};
  before.rotation_2sigma_rad = {1e-4, 2e-4, 3e-4};
  EXPECT_EQ(rig_text(before), rig_text(rig()));  // of the table there is nothing to say
  for (const auto frame : {image::Rig::Frame::flange, image::Rig::Frame::base}) {
    before.frame = frame;
    const image::Rig after = load_rig(write(rig_text(before)));
    EXPECT_EQ(after.frame, frame);
    EXPECT_EQ(after.position_2sigma_m, before.position_2sigma_m);
    EXPECT_EQ(after.rotation_2sigma_rad, before.rotation_2sigma_rad);
    EXPECT_NE(
        complaint(replaced(rig_text(before), "position_2sigma_m: [", "position_2sigma_m: [7, ")),
        "");
    EXPECT_THROW(camera_on_table(after, "f", ""), ConfigError);
  }
}

TEST_F(RigFile, EveryMistakeIsToldWithItsPlace) {
  const std::string good = rig_text(rig());
  ASSERT_EQ(complaint(good), "");
  const struct {
    const char *from, *to, *told;
  } mistakes[] = {
      {"mimesis-rig-1", "mimesis-rig-2",
       "rig.yaml:2:9: format: expected one of mimesis-rig-1, found 'mimesis-rig-2'"},
      {"format:", "fromat:", "unknown parameter, did you mean 'format'?"},
      {"2026-11-26", "2026-13-26", "rig.yaml:3:7: date: expected YYYY-MM-DD, found '2026-13-26'"},
      {"2026-11-26", "yesterday", "expected YYYY-MM-DD, found 'yesterday'"},
      {"frame: \"table\"", "frame: world",
       "rig.yaml:5:8: frame: expected one of camera, table, flange, base"},
      {"pictures: 13", "pictures: -1", "rig.yaml:6:11: pictures: -1 is outside [0, 1000000]"},
      {"pictures: 13\n", "", "pictures: is missing"},
      {"name: \"right\"", "name: left", "cameras.1.name: 'left' is there twice"},
      {"width_px: 640", "width_px: 0",
       "rig.yaml:10:15: cameras.0.width_px: 0 is outside [8, 16384]"},
      {"width_px: 640", "width_px: 300", "cameras.0.cx_px: is beyond the picture's width_px"},
      {"fx_px: 533.5", "fx_px: -533.5", "cameras.0.fx_px: -533.5 is outside"},
      {"fx_px: 533.5", "fx_px: nan", "cameras.0.fx_px: expected a number, found 'nan'"},
      {"    fx_px: 533.5\n", "", "cameras.0.fx_px: is missing, expected a number in [10, 1000000]"},
      {"distortion: [-0.28, ", "distortion: [",
       "cameras.0.distortion: expected 5 numbers, found 4"},
      {"distortion: [-0.28", "distortion: [-2.8", "folds the picture over"},
      {"orientation: [", "orientation: [0.5, 0.5, 0.5, 0.4] #",
       "expected a unit quaternion w x y z"},
      {"cameras:", "cameras: []\nspare:", "unknown parameter"},
      {"pictures: 13", "pictures: 13\npictures: 14", "pictures"},
  };
  for (const auto& m : mistakes) {
    const std::string told = complaint(replaced(good, m.from, m.to));
    EXPECT_NE(told.find(m.told), std::string::npos) << m.to << "\n" << told;
    EXPECT_TRUE(told.starts_with("rig.yaml:")) << told;
  }
  EXPECT_THROW(load_rig((folder_ / "absent.yaml").string()), ConfigError);
}

/// Random damage to bytes: the reader refuses in words, or gives cameras that can be used.
TEST_F(RigFile, SurvivesDamage) {
  const std::string good = rig_text(rig());
  std::mt19937 random(77);
  int refused = 0;
  for (int i = 0; i < 600; ++i) {
    std::string text = good;
    for (int k = 0; k <= i % 3; ++k) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text[at] = static_cast<char>(random());
          break;
        case 1:
          text.erase(at, 1 + random() % 20);
          break;
        case 2:
          text.insert(at, 1, "0123456789-:.[]{}\"#\n e"[random() % 22]);
          break;
        default:
          text.resize(at + 1);
      }
    }
    try {
      for (const image::RigCamera& c : load_rig(write(text)).cameras) {
        const Eigen::Vector2d pixel = c.camera.lens().project({0.01, 0.02, 1.0});
        EXPECT_TRUE(pixel.allFinite()) << text;
        EXPECT_NEAR(c.camera.R_CT().determinant(), 1.0, 1e-9) << text;
      }
    } catch (const ConfigError& e) {
      ++refused;
      EXPECT_NE(std::string(e.what()).find("rig.yaml"), std::string::npos) << e.what();
    }
  }
  EXPECT_GT(refused, 300);
}

TEST(CameraOnTable, IsChosenByNameAndMustKnowTheTable) {
  image::Rig r = rig();
  EXPECT_EQ(camera_on_table(r, "f", "").eye(), r.cameras[0].camera.eye());
  EXPECT_EQ(camera_on_table(r, "f", "right").eye(), r.cameras[1].camera.eye());
  const std::string refused = testing::refusal([&] { camera_on_table(r, "f.yaml", "rihgt"); });
  EXPECT_EQ(refused, "f.yaml: no camera 'rihgt', did you mean 'right'?; there are: left, right");
  r.frame = image::Rig::Frame::camera;
  EXPECT_THROW(camera_on_table(r, "f", ""), ConfigError);
}

TEST(DayNumber, CountsFrom1970) {
  EXPECT_EQ(day_number("1970-01-01"), 0);
  EXPECT_EQ(day_number("2000-03-01"), 11017);
  for (const char* none :
       {"", "2026-2-30", "2026-02-30", "26-01-01", "2026-01-011", "2026/01/01"}) {
    EXPECT_FALSE(day_number(none)) << none;
  }
}

}  // namespace
}  // namespace mimesis::model
