// `mimesis vision` as people call it, and the files that it writes.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "common/image/image.h"
#include "common/testing/process.h"
#include "common/testing/refusal.h"
#include "common/testing/temporary_folder.h"
#include "nodes/vision/files/colors_file.h"

namespace mimesis::tool {
namespace {

using vision::Kind;

class Teach : public testing::VerbTest {
 protected:
  void SetUp() override {
    image::Image image(320, 240);  // a blue and a green patch on grey
    std::mt19937 random(4);
    for (int v = 0; v < 240; ++v) {
      for (int u = 0; u < 320; ++u) {
        const bool blue = u >= 40 && u < 100 && v >= 50 && v < 110,
                   green = u >= 200 && u < 260 && v >= 50 && v < 110;
        const std::array<int, 3> color = blue    ? std::array{205, 96, 38}
                                         : green ? std::array{90, 200, 90}
                                                 : std::array{145, 151, 155};
        for (std::size_t c = 0; c < 3; ++c)
          image.at(u, v)[c] =
              static_cast<std::uint8_t>(color[c] + static_cast<int>(random() % 9) - 4);
      }
    }
    ASSERT_TRUE(image::write_png(folder_ / "desk.png", image));
  }

  int run(std::vector<std::string> words) {
    words.insert(words.begin(), {"teach", (folder_ / "desk.png").string()});
    return vision(words);
  }
  int vision(std::vector<std::string> words) {
    words.insert(words.begin(), "vision");
    return call(words);
  }
  /// The reader's complaint about the file with `from` replaced by `to`; "" if it takes it.
  std::string complaint(const std::string& from, const std::string& to) {
    std::string text = good_;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    std::ofstream(folder_ / "edited.yaml") << text.replace(at, from.size(), to);
    return testing::refusal([&] { vision::load_colors(folder_ / "edited.yaml"); });
  }

  testing::TemporaryFolder folder_;
  std::string good_;
};

TEST_F(Teach, WritesColoursThatAreReadAgain) {
  const std::string file = folder_ / "colors.yaml", picture = folder_ / "seen.png";
  ASSERT_EQ(run({"--region", "bar=45,55,50,50", "--region", "object=230,80", "-o", file,
                 "--picture", picture, "--json"}),
            0)
      << errors_;
  const auto report = nlohmann::json::parse(output_);
  ASSERT_EQ(report["classes"].size(), 2u);
  EXPECT_EQ(report["classes"][0]["name"], "object");
  EXPECT_NEAR(report["classes"][0]["share"].get<double>(), 3600.0 / (320 * 240), 0.003);
  EXPECT_TRUE(report["warnings"].empty());
  EXPECT_TRUE(image::read_image(picture));
  const vision::TaughtColors colors = vision::load_colors(file);
  EXPECT_NEAR(colors.reference_bgr[0], 145.0, 1.0);
  const vision::ColorTable table(colors.spots);
  EXPECT_EQ(table.label(205, 96, 38), Kind::bar);
  EXPECT_EQ(table.label(90, 200, 90), Kind::object);
  EXPECT_EQ(table.label(145, 151, 155), Kind::none);
  EXPECT_EQ(table.label(124, 156, 214), Kind::none);  // skin was not taught

  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  good_ = text.str();
  EXPECT_EQ(complaint("mimesis-colors-2", "mimesis-colors-2"), "");
  EXPECT_NE(complaint("colors-2", "colors-1")
                .find("edited.yaml:2:9: format: expected one of mimesis-colors-2"),
            std::string::npos);
  EXPECT_NE(complaint("name: \"bar\"", "name: object").find("'object' is there twice"),
            std::string::npos);
  EXPECT_NE(complaint("name: \"bar\"", "name: baar").find("no class 'baar', did you mean 'bar'?"),
            std::string::npos);
  EXPECT_NE(complaint("u_deviation", "u_dev").find("unknown parameter"), std::string::npos);
  EXPECT_NE(complaint("correlation: ", "correlation: 7 #").find("7 is outside [-0.99, 0.99]"),
            std::string::npos);
  EXPECT_NE(complaint(good_.substr(good_.find("classes:")), "classes: []\n")
                .find("classes: there is none"),
            std::string::npos);
}

TEST_F(Teach, MistakesAreToldInOneLine) {
  EXPECT_EQ(run({"--region", "baar=45,55,50,50"}), 2);
  EXPECT_NE(errors_.find("--region baar=45,55,50,50: no class 'baar', did you mean 'bar'?"),
            std::string::npos)
      << errors_;
  for (const char* wrong : {"bar", "bar=", "bar=1,2,3", "bar=1,2,3,4,5", "bar=a,2", "=1,2"}) {
    EXPECT_EQ(run({"--region", wrong}), 2) << wrong;
    EXPECT_NE(errors_.find(std::string("--region ") + wrong + ": "), std::string::npos) << errors_;
  }
  EXPECT_EQ(run({"--region", "bar=300,55,50,50"}), 2);
  EXPECT_NE(errors_.find("are not within the picture of 320x240"), std::string::npos) << errors_;
  EXPECT_EQ(run({"--region", "hand=10,10,30,20"}), 0);  // the table is no hand, but who knows
  EXPECT_NE(errors_.find("hand has the chroma of the table"), std::string::npos) << errors_;
}

TEST_F(Teach, CheckSaysWhatToChangeOnTheDesk) {
  const std::string file = folder_ / "colors.yaml", desk = folder_ / "desk.png";
  ASSERT_EQ(run({"--region", "bar=45,55,50,50", "--region", "object=230,80", "-o", file}), 0);
  EXPECT_EQ(vision({"check", desk, desk, desk, "--colors", file}), 0) << output_ << errors_;
  EXPECT_NE(output_.find("median luma"), std::string::npos) << output_;
  image::Image dark(320, 240);
  ASSERT_TRUE(image::write_png(folder_ / "dark.png", dark));
  EXPECT_EQ(vision({"check", (folder_ / "dark.png").string(), "--colors", file, "--json"}), 1);
  const auto report = nlohmann::json::parse(output_);
  EXPECT_EQ(report["median_luma"], 0.0);
  EXPECT_TRUE(report["blur_px"].is_null());
  EXPECT_GE(report["advice"].size(), 4u) << output_;  // focus, exposure, two classes
  EXPECT_EQ(vision({"check", (folder_ / "absent.png").string()}), 2);
  EXPECT_NE(errors_.find("absent.png"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::tool
