// Fields and images of a log as files.
#include "tools/mimesis/log/export.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/error.h"
#include "common/image/image.h"
#include "common/testing/refusal.h"
#include "proto/bridge.pb.h"
#include "proto/foxglove/image.pb.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/field_text.h"
#include "tools/mimesis/log/field_columns.h"
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
  EXPECT_EQ(
      why({"json.a"}),
      "json: messages are 'raw', not Protobuf or ROS with a schema: they have no fields to choose");
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

/// "name=value" of all that `path` gives.
std::vector<std::string> values(const google::protobuf::Message& m, const std::string& path) {
  FieldColumns columns({"topic", path});
  std::vector<std::string> out;
  columns.visit(m, [&](const auto& key, const auto& v) {
    out.push_back(columns.name(key) + "=" + field_text(v.message, v.field, v.index));
  });
  return out;
}
using Values = std::vector<std::string>;

std::string mistake(const google::protobuf::Message& m, const std::string& path) {
  return testing::refusal([&] { values(m, path); });
}

TEST(FieldColumns, ElementsNestedFieldsAndWholeMessages) {
  v1::JointState m;
  m.mutable_header()->set_seq(3);
  for (const double p : {0.1, -0.0, 1e300}) m.add_position_rad(p);
  EXPECT_EQ(values(m, "position_rad[2]"), Values{"position_rad[2]=1e+300"});
  EXPECT_EQ(values(m, "position_rad.1"), Values{"position_rad[1]=-0"});
  EXPECT_EQ(values(m, "position_rad[3]"), Values{});
  const Values all{"position_rad[0]=0.1", "position_rad[1]=-0", "position_rad[2]=1e+300"};
  EXPECT_EQ(values(m, "position_rad[*]"), all);
  EXPECT_EQ(values(m, "position_rad"), all);
  EXPECT_EQ(values(m, "position_rad.*"), all);
  EXPECT_EQ(values(m, "header"), (Values{"header.stamp_ns=0", "header.seq=3"}));
  EXPECT_EQ(values(m, "").size(), 2 + 3 + 2u);  // header, positions, operational, fault
}

TEST(FieldColumns, RepeatedMessages) {
  v1::StepLog m;
  for (std::uint64_t i = 0; i < 4; ++i) {
    if (i % 2 == 0) m.add_steps();
    m.mutable_steps(static_cast<int>(i / 2))->add_taken()->set_seq(i);
  }
  EXPECT_EQ(values(m, "steps[1].taken[0].seq"), Values{"steps[1].taken[0].seq=2"});
  EXPECT_EQ(values(m, "steps[*].taken[1].seq"),
            (Values{"steps[0].taken[1].seq=1", "steps[1].taken[1].seq=3"}));
  EXPECT_EQ(values(m, "steps.taken.seq").size(), 4u);
  EXPECT_EQ(values(m, "steps.taken.seq")[3], "steps[1].taken[1].seq=3");
}

TEST(FieldColumns, BytesOnlyWhereTheyAreNamed) {
  foxglove::RawImage m;
  m.set_data("\x01\xff");
  EXPECT_EQ(values(m, "data"), Values{"data=01ff"});
  for (const std::string& v : values(m, "")) EXPECT_FALSE(v.starts_with("data")) << v;
}

TEST(FieldColumns, MistakesSayWhatIsWrong) {
  const v1::JointState m;
  EXPECT_EQ(
      mistake(m, "positon_rad"),
      "topic: mimesis.v1.JointState has no field 'positon_rad', did you mean 'position_rad'?");
  EXPECT_EQ(mistake(m, "header.sek"),
            "topic: mimesis.v1.Header has no field 'sek', did you mean 'seq'?");
  EXPECT_EQ(mistake(m, "fault.x"), "topic.fault.x: fault of mimesis.v1.JointState has no 'x'");
  EXPECT_EQ(mistake(m, "position_rad[x]"),
            "topic.position_rad[x]: position_rad of mimesis.v1.JointState has no 'x'");
  EXPECT_NE(mistake(m, "position_rad[-1]"), "");
  for (const char* path : {".", "a.", "a..b", "a[]", "[", "]"}) EXPECT_NE(mistake(m, path), "");
}

TEST(FieldQuery, TopicsMayContainDots) {
  const std::vector<std::string> topics{"bridge/joint_states", "a.b", "a", "a.b.c/d"};
  const auto split = [&](const std::string& text) {
    const FieldQuery q = parse_field_query(text, topics);
    return q.topic + "|" + q.path;
  };
  EXPECT_EQ(split("bridge/joint_states.position_rad[*]"), "bridge/joint_states|position_rad[*]");
  EXPECT_EQ(split("a.b.c"), "a.b|c");
  EXPECT_EQ(split("a.c"), "a|c");
  EXPECT_EQ(split("a.b.c/d"), "a.b.c/d|");
  EXPECT_THROW(split("bridge/joint_statess.x"), ConfigError);
  EXPECT_THROW(split(""), ConfigError);
  EXPECT_THROW(split("."), ConfigError);
}
}  // namespace
}  // namespace mimesis::tool
