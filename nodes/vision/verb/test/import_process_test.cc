// `mimesis calibrate import` as people call it.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "common/model/rig_file.h"
#include "common/testing/process.h"
#include "common/testing/temporary_folder.h"

namespace mimesis::tool {
namespace {

class CalibrateImport : public testing::VerbTest {
 protected:
  std::string write(const char* name, const std::string& projection) {
    std::ofstream(folder_ / name)
        << "image_width: 640\nimage_height: 480\ncamera_name: usb\ncamera_matrix: {rows: 3, cols: "
           "3, "
           "data: [500, 0, 320, 0, 500, 240, 0, 0, 1]}\ndistortion_model: plumb_bob\n"
           "distortion_coefficients: {rows: 1, cols: 5, data: [-0.1, 0.02, 0, 0, 0]}\n"
           "rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n"
           "projection_matrix: {rows: 3, cols: 4, data: ["
        << projection << "]}\n";
    return folder_ / name;
  }
  testing::TemporaryFolder folder_;
};

TEST_F(CalibrateImport, MakesARigThatOthersRead) {
  const std::string left = write("left.yaml", "480, 0, 320, 0, 0, 480, 240, 0, 0, 0, 1, 0"),
                    right = write("right.yaml", "480, 0, 320, -48, 0, 480, 240, 0, 0, 0, 1, 0"),
                    out = folder_ / "rig.yaml";
  ASSERT_EQ(call({"calibrate", "import", left, right, "--date", "2026-03-14", "-o", out, "--json"}),
            0)
      << errors_;
  const auto report = nlohmann::json::parse(output_);
  EXPECT_EQ(report["kind"], "a ROS camera_info");
  EXPECT_NEAR(report["cameras"][1]["position_m"][0].get<double>(), 0.1, 1e-12);
  const image::Rig rig = model::load_rig(out);
  EXPECT_EQ(rig.date, "2026-03-14");
  EXPECT_NEAR(rig.cameras[1].camera.eye().x(), 0.1, 1e-12);

  ASSERT_EQ(call({"calibrate", "import", right, "--date", "2026-03-14", "-o", out}), 0) << errors_;
  EXPECT_NE(output_.find("taken as a camera alone"), std::string::npos) << output_;
  EXPECT_NE(output_.find("written: " + out + " from a ROS camera_info"), std::string::npos);
}

TEST_F(CalibrateImport, RefusesInOneLine) {
  const std::string left = write("left.yaml", "480, 0, 320, 0, 0, 480, 240, 0, 0, 0, 1, 0"),
                    out = folder_ / "rig.yaml";
  EXPECT_EQ(call({"calibrate", "import", left, "--date", "14.3.2026", "-o", out}), 2);
  EXPECT_NE(errors_.find("--date: expected YYYY-MM-DD, found '14.3.2026'"), std::string::npos);
  EXPECT_EQ(call({"calibrate", "import", left, "--date", "2026-03-14", "--size", "640", "-o", out}),
            2);
  EXPECT_NE(errors_.find("--size: expected WIDTHxHEIGHT, as 640x480, found '640'"),
            std::string::npos);
  EXPECT_EQ(call({"calibrate", "import", left, left, "--date", "2026-03-14", "-o", out}), 2);
  EXPECT_NE(errors_.find("has no baseline"), std::string::npos) << errors_;
  EXPECT_FALSE(std::ifstream(out).good());
  EXPECT_EQ(call({"calibrate", "table", left, "a.png", "--square-m", "0.025"}), 2);
  EXPECT_NE(errors_.find(left + ": is a ROS camera_info, expected a rig: mimesis calibrate import"),
            std::string::npos)
      << errors_;
}

}  // namespace
}  // namespace mimesis::tool
