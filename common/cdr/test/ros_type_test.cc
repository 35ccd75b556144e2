#include "common/cdr/ros_type.h"

#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <string>

#include "common/error.h"

namespace mimesis::cdr {
namespace {

using namespace std::literals;

/// CDR as the specification says it, for what a test expects.
class Bytes {
 public:
  explicit Bytes(bool little = true, std::size_t most = 8) : little_(little), most_(most) {
    text_ = {'\0', static_cast<char>((most == 8 ? 0 : 6) + (little ? 1 : 0)), '\0', '\0'};
  }
  template <class T>
  Bytes& put(T value) {
    while ((text_.size() - 4) % std::min(sizeof(T), most_) != 0) text_ += '\0';
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof value);
    const bool as_is = little_ == (std::endian::native == std::endian::little);
    for (std::size_t i = 0; i < sizeof(T); ++i) text_ += raw[as_is ? i : sizeof(T) - 1 - i];
    return *this;
  }
  Bytes& put_text(const std::string& s) {
    put<std::uint32_t>(static_cast<std::uint32_t>(s.size() + 1));
    text_ += s + '\0';
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  bool little_;
  std::size_t most_;
  std::string text_;
};

std::string json(const RosType& type, const std::string& bytes) {
  const auto message = type.make();
  const std::string why = type.read(bytes, *message);
  if (!why.empty()) return why;
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = options.preserve_proto_field_names = true;
  std::string out;
  EXPECT_TRUE(google::protobuf::util::MessageToJsonString(*message, &out, options).ok());
  return out;
}

std::string mistake(const std::string& name, std::string_view encoding, std::string_view text) {
  try {
    (void)RosType::parse(name, encoding, text);
    return "";
  } catch (const ConfigError& e) {
    return e.what();
  }
}

constexpr auto kPose = R"(# A pose with all kinds of fields.
uint8 OK=0            # a constant
string GREETING = "a # b"
std_msgs/Header header
float64[3] position 0.0
int8 small -1
bool is_good true
float32[] weights
string<=8[<=2] names
Inner[] inner   # of this package
byte[] raw
================================================================================
MSG: test/Inner
int16 a
uint64 b
)"sv;

constexpr auto kPoseIdl = R"(// generated from rosidl_adapter
#include "std_msgs/msg/Header.idl"
module test { module msg {
  module Pose_Constants { const uint8 OK = 0; };
  typedef double double__3[3];
  @verbatim (language="comment", text="A pose (with ) brackets" "and more")
  struct Pose {
    std_msgs::msg::Header header;
    @default (value=0.0) double__3 position;
    int8 small;
    boolean is_good;
    sequence<float> weights;
    sequence<string<8>, 2> names;
    sequence<test::msg::Inner> inner;
    sequence<octet> raw;
  }; }; };
================================================================================
IDL: test/msg/Inner
module test { module msg { struct Inner { short a; unsigned long long b; }; }; };
)"sv;

std::string pose(bool little, std::size_t most) {
  Bytes b(little, most);
  b.put<std::int32_t>(12).put<std::uint32_t>(34).put_text("map");
  for (const double x : {1.5, -2.0, 0.25}) b.put(x);
  b.put<std::int8_t>(-7).put<std::uint8_t>(1);
  b.put<std::uint32_t>(2).put(0.5F).put(4.0F);
  b.put<std::uint32_t>(2).put_text("a").put_text("bcd");
  b.put<std::uint32_t>(2);
  for (const int a : {-3, 4}) b.put(static_cast<std::int16_t>(a)).put<std::uint64_t>(1ULL << 40U);
  b.put<std::uint32_t>(3).put('x').put('y').put('z');
  return b.text();
}

constexpr auto kPoseJson =
    R"({"header":{"stamp":{"sec":12,"nanosec":34},"frame_id":"map"},"position":[1.5,-2,0.25],)"
    R"("small":-7,"is_good":true,"weights":[0.5,4],"names":["a","bcd"],)"
    R"("inner":[{"a":-3,"b":"1099511627776"},{"a":4,"b":"1099511627776"}],"raw":"eHl6"})"sv;

TEST(RosType, ReadsAllKindsOfFieldsInBothOrdersOfBytesAndBothAlignments) {
  for (const auto& [encoding, text] :
       {std::pair("ros2msg", kPose), std::pair("ros2idl", kPoseIdl)}) {
    const auto type = RosType::parse("test/msg/Pose", encoding, text);
    for (const bool little : {true, false}) {
      for (const std::size_t most : {8, 4}) {
        EXPECT_EQ(json(*type, pose(little, most)), kPoseJson) << encoding << little << most;
      }
    }
  }
}

TEST(RosType, NamesTheFieldWhereBytesEnd) {
  const auto type = RosType::parse("test/msg/Pose", "ros2msg", kPose);
  const std::string whole = pose(true, 8);
  for (std::size_t n = 0; n < whole.size(); ++n) {
    EXPECT_NE(json(*type, whole.substr(0, n)).find(n < 4 ? "shorter" : "the message ends"),
              std::string::npos)
        << n;
  }
  EXPECT_EQ(json(*type, whole.substr(0, 12)), "field header.frame_id: the message ends");
  EXPECT_EQ(json(*type, whole + "abc"), kPoseJson) << "padding";
  EXPECT_EQ(json(*type, whole + "abcd"), "4 bytes more than the type has");
  EXPECT_NE(json(*type, "\0\3"s + whole.substr(2)).find("its header says 0003"), std::string::npos);
  EXPECT_EQ(json(*RosType::parse("a/B", "ros2msg", "string<=3[<=1] x"),
                 Bytes().put<std::uint32_t>(2).text()),
            "field x: 2 elements, at most 1");
  EXPECT_EQ(json(*RosType::parse("a/B", "ros2msg", "float64[] x"),
                 Bytes().put<std::uint32_t>(0xFFFFFFF0U).text()),
            "field x: the message ends");
  EXPECT_EQ(json(*RosType::parse("a/B", "ros2msg", "bool x"), Bytes().put<std::uint8_t>(7).text()),
            "field x: 7 is no bool");
}

TEST(RosType, ReadsEmptyMessagesServiceEventsAndOldNames) {
  const auto empty = RosType::parse("std_msgs/msg/Empty", "ros2msg", "");
  EXPECT_EQ(json(*empty, Bytes().put<std::uint8_t>(0).text()), "{}");
  EXPECT_EQ(json(*empty, Bytes().put<std::uint32_t>(0).text()), "{}");
  const auto idl = RosType::parse(
      "a/msg/E", "ros2idl",
      "module a { module msg { struct E { uint8 structure_needs_at_least_one_member; }; }; };");
  EXPECT_EQ(json(*idl, Bytes().put<std::uint8_t>(0).text()), "{}");

  // With and without the heading that later rosbag2 write.
  const std::string heading = std::string(80, '=') + "\nSRV: ex/srv/Add\n";
  const std::string service = "int64 a\nint64 b\n---\nint64 sum\n";
  (void)RosType::parse("ex/srv/Add_Event", "ros2msg", service);
  const auto event = RosType::parse("ex/srv/Add_Event", "ros2msg", heading + service);
  Bytes b;
  b.put<std::uint8_t>(1).put<std::int32_t>(5).put<std::uint32_t>(6);
  for (char i = 0; i < 16; ++i) b.put(i);
  b.put<std::int64_t>(9).put<std::uint32_t>(1).put<std::int64_t>(2).put<std::int64_t>(3);
  b.put<std::uint32_t>(0);
  EXPECT_EQ(json(*event, b.text()),
            R"({"info":{"event_type":1,"stamp":{"sec":5,"nanosec":6},"client_gid":)"
            R"("AAECAwQFBgcICQoLDA0ODw==","sequence_number":"9"},)"
            R"("request":[{"a":"2","b":"3"}],"response":[]})");
  EXPECT_EQ(json(*event, b.text().substr(0, 44) + "\2\0\0\0"s),
            "field request: 2 elements, at most 1");
  EXPECT_EQ(
      json(*RosType::parse("test/Old", "ros2msg", "Header h\ntime t\nchar c"),
           Bytes()
               .put<std::int32_t>(1)
               .put<std::uint32_t>(2)
               .put_text("f")
               .put<std::int32_t>(3)
               .put<std::uint32_t>(4)
               .put<std::uint8_t>(200)
               .text()),
      R"({"h":{"stamp":{"sec":1,"nanosec":2},"frame_id":"f"},"t":{"sec":3,"nanosec":4},"c":200})");
}

TEST(RosType, ReadsWideStringsInFourAndInTwoBytes) {
  const auto type = RosType::parse("a/msg/W", "ros2msg", "wstring w\nint32 n");
  Bytes four, two;
  four.put<std::uint32_t>(2).put<std::uint32_t>('h').put<std::uint32_t>(0xE9);
  two.put<std::uint32_t>(3).put<std::uint16_t>('h').put<std::uint16_t>(0xD83D);
  two.put<std::uint16_t>(0xDE00);
  EXPECT_EQ(json(*type, four.put<std::int32_t>(5).text()), "{\"w\":\"h\u00e9\",\"n\":5}");
  EXPECT_EQ(json(*type, two.put<std::int32_t>(5).text()), "{\"w\":\"h\U0001F600\",\"n\":5}");
}

TEST(RosType, RefusesDefinitionsByLine) {
  EXPECT_EQ(mistake("a/msg/B", "ros2msg", "\nint32\n"),
            "line 2: 'int32': expected a type and a name");
  EXPECT_EQ(mistake("a/msg/B", "ros2msg", "int32[x] y"),
            "line 1: 'x': expected a number of elements");
  EXPECT_EQ(mistake("a/msg/B", "ros2msg", "int32 3d"),
            "line 1: 'int32 3d': expected the name of a field");
  EXPECT_EQ(mistake("a/msg/B", "ros2msg", "other/Thing x"),
            "other/Thing of field 'x' of a/B is not defined");
  EXPECT_EQ(mistake("a/msg/B", "ros2msg", "int32 x\nint32 x"), "line 2: field 'x' is there twice");
  EXPECT_EQ(mistake("B", "ros2msg", "int32 x"), "'B': expected package/msg/Type");
  EXPECT_EQ(mistake("a/msg/B", "ros2msg", "B b"), "a/B: types contain each other");
  EXPECT_EQ(mistake("a/msg/B", "ros2idl", "module a { struct C { long x; }; };"),
            "a/msg/B is not defined");
  EXPECT_EQ(mistake("a/msg/B", "ros2idl", "module a { union U { }; };"),
            "line 1: 'union': expected module, struct, typedef, enum or const");
  EXPECT_EQ(mistake("a/msg/B", "ros2idl", "module a {\n struct B { long double x; }; };"),
            "line 2: 'double': expected no long double, which ROS does not have");
  EXPECT_EQ(mistake("a/msg/B", "ros2idl", "@verbatim (a=\n\"x\ny\",\n b=1)\nunion"),
            "line 5: 'union': expected module, struct, typedef, enum or const");
  EXPECT_EQ(mistake("a/msg/B", "ros2idl", "module a {\n struct B { long"),
            "line 2: the end: expected the name of a field");
}

}  // namespace
}  // namespace mimesis::cdr
