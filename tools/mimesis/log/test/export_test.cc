// Fields and images of a log as files.
#include "tools/mimesis/log/export.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/image/image.h"
#include "common/testing/refusal.h"
#include "proto/bridge.pb.h"
#include "tools/mimesis/log/test/log_builder.h"

namespace mimesis::tool {
namespace {

v1::JointState arm_state(std::vector<double> positions, const std::string& fault = "") {
  v1::JointState m;
  for (const double p : positions) m.add_position_rad(p);
  m.set_fault(fault);
  return m;
}

class ExportTest : public ::testing::Test {
 protected:
  std::string csv(ExportOptions options) {
    if (options.output.empty()) options.output = folder_.file("out.csv");
    std::vector<OpenLog> logs;
    logs.push_back(log_.open());
    result_ = export_csv(logs, options);
    return std::filesystem::is_directory(options.output) ? "" : folder_.read("out.csv");
  }
  LogBuilder log_;
  TestFolder folder_;
  ExportResult result_;
};

TEST_F(ExportTest, NumbersAreExactTextsQuotedAndMissingElementsEmpty) {
  log_.add("x/arm", 2'000'000'000, arm_state({0.1, 1.0 / 3.0}));
  log_.add("x/arm", 2'000'000'001, arm_state({-0.0, NAN, 5e-324}, "axis \"3\", twice\n"));
  EXPECT_EQ(csv({.csv = {"x/arm.position_rad[*],fault"}}),
            "log_time_s,publish_time_s,position_rad[0],position_rad[1],position_rad[2],fault\n"
            "0.000000000,-0.000000001,0.1,0.3333333333333333,,\n"
            "0.000000001,0.000000000,-0,nan,5e-324,\"axis \"\"3\"\", twice\n\"\n");
  EXPECT_EQ(result_.items, 2u);
  EXPECT_EQ(result_.failures, 0u);
}

TEST_F(ExportTest, APartOfTheLog) {
  for (std::uint64_t s : {0, 1, 2, 3}) {
    log_.add("x/arm", 1'795'275'600'250'000'000 + s * 1'000'000'000,
             arm_state({static_cast<double>(s)}));
  }
  EXPECT_EQ(csv({.csv = {"x/arm.position_rad"}, .range = {.start = "1", .end = "2"}}),
            "log_time_s,publish_time_s,position_rad[0]\n"
            "1.000000000,0.999999999,1\n");
}

TEST_F(ExportTest, AFileForEachTopic) {
  log_.add("x/arm", 1000, arm_state({1.0}))
      .add("y/arm", 2000, arm_state({2.0}))
      .add("x/arm", 3000, arm_state({3.0}));
  csv({.csv = {"x/arm.position_rad", "y/arm.position_rad"}, .output = folder_.file("tables")});
  EXPECT_EQ(result_.files.size(), 2u);
  EXPECT_EQ(folder_.read("tables/y_arm.csv"),
            "log_time_s,publish_time_s,position_rad[0]\n0.000001000,0.000000999,2\n");
}

TEST_F(ExportTest, TwoNodesOfOneTopicAreTold) {
  log_.add("x", 1, arm_state({1.0}), 1, "left").add("x", 2, arm_state({2.0}), 1, "right");
  EXPECT_EQ(csv({.csv = {"x.position_rad[0]"}}),
            "log_time_s,publish_time_s,node,position_rad[0]\n"
            "0.000000000,-0.000000001,left,1\n"
            "0.000000001,0.000000000,right,2\n");
}

TEST_F(ExportTest, WhatCannotBeReadIsCountedAndTheRestWritten) {
  log_.add("x", 1, arm_state({1.0})).add_bytes("x", 2, "\xff\xff").add("x", 3, arm_state({3.0}));
  EXPECT_EQ(csv({.csv = {"x.position_rad[0]"}}),
            "log_time_s,publish_time_s,position_rad[0]\n"
            "0.000000000,-0.000000001,1\n0.000000002,0.000000001,3\n");
  EXPECT_EQ(result_.failures, 1u);
}

TEST_F(ExportTest, MistakesAreToldBeforeAnythingIsWritten) {
  log_.add("x", 1, arm_state({1.0})).add_bytes("json", 2, "{}");
  std::vector<OpenLog> logs;
  logs.push_back(log_.open());
  const auto why = [&](std::vector<std::string> fields) -> std::string {
    return testing::refusal(
        [&] { export_csv(logs, {.csv = std::move(fields), .output = folder_.file("never.csv")}); });
  };
  EXPECT_EQ(why({"x.position_rd"}),
            "x: mimesis.v1.JointState has no field 'position_rd', did you mean 'position_rad'?");
  EXPECT_EQ(why({"x.position_rad,"}), "--csv x.position_rad,: expected a field behind the comma");
  EXPECT_EQ(why({"json.a"}),
            "json: messages are 'raw', not Protobuf with a schema: they have no fields to choose");
  EXPECT_FALSE(std::filesystem::exists(folder_.file("never.csv")));
}

foxglove::RawImage raw(const std::string& encoding, std::uint32_t width, std::uint32_t height,
                       std::uint32_t step, const std::string& data) {
  foxglove::RawImage m;
  m.set_encoding(encoding);
  m.set_width(width);
  m.set_height(height);
  m.set_step(step);
  m.set_data(data);
  return m;
}
using Pixels = std::vector<std::uint8_t>;

TEST(RawImage, EncodingsBecomeBlueGreenRed) {
  EXPECT_EQ(raw_image(raw("bgr8", 1, 2, 4, "abcXdefX"))->bgr,
            (Pixels{'a', 'b', 'c', 'd', 'e', 'f'}));
  EXPECT_EQ(raw_image(raw("rgb8", 1, 1, 3, "abc"))->bgr, (Pixels{'c', 'b', 'a'}));
  EXPECT_EQ(raw_image(raw("rgba8", 1, 1, 4, "abcd"))->bgr, (Pixels{'c', 'b', 'a'}));
  EXPECT_EQ(raw_image(raw("mono8", 2, 1, 2, "ab"))->bgr, (Pixels{'a', 'a', 'a', 'b', 'b', 'b'}));
  const std::string uyvy("\x80\x40\x80\xff", 4), yuyv("\x40\x80\xff\x80", 4);  // greys 0x40, 0xff
  const Pixels greys{0x40, 0x40, 0x40, 0xff, 0xff, 0xff};
  EXPECT_EQ(raw_image(raw("uyvy", 2, 1, 4, uyvy))->bgr, greys);
  EXPECT_EQ(raw_image(raw("yuv422_yuy2", 2, 1, 4, yuyv))->bgr, greys);
  // Y 100, U 108, V 178: red 100 + 1.402 * 50, green 100 + 0.344 * 20 - 0.714 * 50, blue.
  EXPECT_EQ(raw_image(raw("yuyv", 2, 1, 4, "\x64\x6c\x64\xb2"))->bgr,
            (Pixels{65, 71, 170, 65, 71, 170}));
  // BT.601: Y 76, U 85, V 255 is pure red.
  const Pixels red = raw_image(raw("nv12", 2, 2, 2, "LLLL\x55\xff"))->bgr;
  for (std::size_t i = 0; i < red.size(); ++i) EXPECT_NEAR(red[i], i % 3 == 2 ? 255 : 0, 1) << i;
}

TEST(RawImage, SizesThatCannotBeAreRefused) {
  EXPECT_EQ(raw_image(raw("bgr8", 2, 2, 6, std::string(11, 'x'))).error().reason,
            "2 x 2 px bgr8 need 12 bytes in rows of 6, found 11 in rows of 6");
  EXPECT_FALSE(raw_image(raw("bgr8", 2, 2, 5, std::string(12, 'x'))));
  EXPECT_FALSE(raw_image(raw("bgr8", 0, 2, 0, "")));
  EXPECT_FALSE(raw_image(raw("bgr8", 4'000'000'000, 4'000'000'000, 0, "")));
  EXPECT_FALSE(raw_image(raw("uyvy", 3, 1, 6, "abcdef")));
  EXPECT_FALSE(raw_image(raw("nv12", 2, 2, 2, "LLLL\x55")));
  EXPECT_NE(raw_image(raw("32FC1", 1, 1, 4, "abcd")).error().reason.find("encoding '32FC1'"),
            std::string::npos);
}

TEST(ExportImages, NamedBySequenceAndTime) {
  LogBuilder builder;
  builder.add("cam", 1'000'000'000, raw("rgb8", 1, 1, 3, "abc"), 7);
  builder.add("cam", 1'500'000'000, raw("32FC1", 1, 1, 4, "abcd"), 8);
  builder.add("cam", 2'250'000'000, raw("rgb8", 1, 1, 3, "abc"), 9);
  foxglove::CompressedImage jpeg;
  jpeg.set_format("jpeg");
  jpeg.set_data("as it is");
  builder.add("small", 1'000'000'000, jpeg);
  jpeg.set_format("../x");
  builder.add("small", 1'000'000'000, jpeg);
  builder.add("x", 1, arm_state({}));
  std::vector<OpenLog> logs;
  logs.push_back(builder.open());
  const TestFolder folder;
  auto result = export_images(logs, {.images = "cam", .output = folder.file("")});
  EXPECT_EQ(result.items, 2u);
  EXPECT_EQ(result.failures, 1u);
  EXPECT_EQ(image::read_image(folder.file("000007_0.999999999.png"))->bgr, (Pixels{'c', 'b', 'a'}));
  EXPECT_TRUE(std::filesystem::exists(folder.file("000009_2.249999999.png")));
  result = export_images(logs, {.images = "small", .output = folder.file("s")});
  EXPECT_EQ(result.items, 1u);
  EXPECT_EQ(result.failures, 1u);
  EXPECT_EQ(folder.read("s/000001_0.999999999.jpg"), "as it is");
  EXPECT_THROW(export_images(logs, {.images = "x", .output = folder.file("")}), ConfigError);
  EXPECT_THROW(export_images(logs, {.images = "cams", .output = folder.file("")}), ConfigError);
}

}  // namespace
}  // namespace mimesis::tool
