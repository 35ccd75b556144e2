// Comparing messages field by field.
#include "tools/mimesis/log/message_diff.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <limits>

#include "proto/bridge.pb.h"
#include "proto/foxglove/image.pb.h"
#include "proto/runtime.pb.h"
#include "proto/steps.pb.h"
#include "proto/vision.pb.h"

namespace mimesis::tool {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

v1::JointState arm(std::vector<double> positions) {
  v1::JointState m;
  m.mutable_header()->set_seq(7);
  for (const double p : positions) m.add_position_rad(p);
  return m;
}

/// "path: a | b" of each described difference.
std::vector<std::string> lines(const MessageDifference& d) {
  std::vector<std::string> out;
  for (const FieldDifference& f : d.fields) out.push_back(f.path + ": " + f.a + " | " + f.b);
  return out;
}
using Lines = std::vector<std::string>;

TEST(MessageDiff, NamesTheElementAndBothValues) {
  const auto d = diff_messages(arm({0.1, 0.2, 0.3}), arm({0.1, 0.25, 0.3}), {});
  EXPECT_EQ(lines(d), Lines{"position_rad.1: 0.2 | 0.25"});
  EXPECT_EQ(d.count, 1u);
  EXPECT_TRUE(diff_messages(arm({0.1}), arm({0.1}), {}).equal());
}

TEST(MessageDiff, ToleranceIsAbsoluteInclusiveAndForFloatingPointAlone) {
  const DiffRules loose{.tolerance = 0.125};
  EXPECT_TRUE(diff_messages(arm({1.0}), arm({1.125}), loose).equal());
  EXPECT_TRUE(diff_messages(arm({1.125}), arm({1.0}), loose).equal());
  EXPECT_FALSE(diff_messages(arm({1.0}), arm({1.126}), loose).equal());
  auto later = arm({1.0});
  later.mutable_header()->set_seq(8);
  EXPECT_EQ(lines(diff_messages(arm({1.0}), later, {.tolerance = 10.0})),
            Lines{"header.seq: 7 | 8"});
}

TEST(MessageDiff, FieldTolerancesGoBeforeTheGeneralOneAndHoldForIntegersAndElements) {
  auto a = arm({1.0, 2.0}), b = arm({1.5, 2.5});
  b.mutable_header()->set_seq(9);
  DiffRules rules{.tolerance = 1.0, .field_tolerance = {{"position_rad", 0.1}, {"header", 2.0}}};
  EXPECT_EQ(lines(diff_messages(a, b, rules)),
            (Lines{"position_rad.0: 1 | 1.5", "position_rad.1: 2 | 2.5"}));
  rules.field_tolerance["position_rad.1"] = 0.5;
  EXPECT_EQ(lines(diff_messages(a, b, rules)), Lines{"position_rad.0: 1 | 1.5"});
  rules.ignore = {"position_rad.0"};
  EXPECT_TRUE(diff_messages(a, b, rules).equal());
}

TEST(MessageDiff, IgnoredFieldsWithAllBelow) {
  auto a = arm({1.0}), b = arm({1.0});
  b.mutable_header()->set_stamp_ns(5);
  EXPECT_FALSE(diff_messages(a, b, {}).equal());
  EXPECT_TRUE(diff_messages(a, b, {.ignore = {"header"}}).equal());
  EXPECT_TRUE(diff_messages(a, b, {.ignore = {"header.stamp_ns"}}).equal());
  EXPECT_FALSE(diff_messages(a, b, {.ignore = {"header.seq"}}).equal());
  v1::StepLog s, t;
  s.add_steps()->add_taken()->set_seq(1);
  t.add_steps()->add_taken()->set_seq(2);
  EXPECT_EQ(lines(diff_messages(s, t, {})), Lines{"steps.0.taken.0.seq: 1 | 2"});
  EXPECT_TRUE(diff_messages(s, t, {.ignore = {"steps.taken.seq"}}).equal());
}

TEST(MessageDiff, NanIsNanAndZeroHasNoSignUnlessExact) {
  const auto a = arm({kNan, 0.0, kInf}), b = arm({-kNan, -0.0, kInf});
  EXPECT_TRUE(diff_messages(a, b, {}).equal());
  EXPECT_EQ(diff_messages(a, b, {.tolerance = 1.0, .exact = true}).count, 2u);
  EXPECT_EQ(lines(diff_messages(arm({0.0}), arm({-0.0}), {.exact = true})),
            Lines{"position_rad.0: 0 | -0"});
  const DiffRules loose{.tolerance = 1e300};
  EXPECT_EQ(lines(diff_messages(arm({kNan}), arm({1.0}), loose)), Lines{"position_rad.0: nan | 1"});
  EXPECT_FALSE(diff_messages(arm({kInf}), arm({-kInf}), loose).equal());
}

TEST(MessageDiff, LengthsAndWhatBothHave) {
  EXPECT_EQ(lines(diff_messages(arm({1.0, 2.0}), arm({1.5}), {})),
            (Lines{"position_rad: 2 elements | 1 elements", "position_rad.0: 1 | 1.5"}));
}

TEST(MessageDiff, LargeIntegersDifferByTheirLastBit) {
  auto a = arm({}), b = arm({});
  a.mutable_header()->set_stamp_ns(18446744073709551615u);
  b.mutable_header()->set_stamp_ns(18446744073709551614u);
  EXPECT_EQ(lines(diff_messages(a, b, {})),
            Lines{"header.stamp_ns: 18446744073709551615 | 18446744073709551614"});
  EXPECT_TRUE(diff_messages(a, b, {.field_tolerance = {{"header.stamp_ns", 1.0}}}).equal());
}

TEST(MessageDiff, EnumsTextsBytesPresenceAndMaps) {
  v1::JointState a, b;
  a.add_drives(v1::DRIVE_STATE_FAULT);
  b.add_drives(v1::DRIVE_STATE_SWITCHED_ON);
  b.set_operational(true);
  b.set_fault("axis 3");
  b.mutable_header();
  EXPECT_EQ(lines(diff_messages(a, b, {.tolerance = 100.0})),
            (Lines{"header: unset | ", "drives.0: DRIVE_STATE_FAULT | DRIVE_STATE_SWITCHED_ON",
                   "operational: false | true", "fault: \"\" | \"axis 3\""}));

  foxglove::RawImage p, q;
  p.set_data(std::string("ab\0cd", 5));
  q.set_data("ab");
  EXPECT_EQ(lines(diff_messages(p, q, {})),
            Lines{"data: 5 bytes, at 2: 00 63 64 | 2 bytes, at 2: end"});

  v1::NodeInfo m, n;
  (*m.mutable_descriptors())["x"] = "1";
  (*m.mutable_descriptors())["y"] = "2";
  (*n.mutable_descriptors())["y"] = "3";
  (*n.mutable_descriptors())["x"] = "1";
  EXPECT_EQ(lines(diff_messages(m, n, {})),
            Lines{"descriptors.y: 1 bytes, at 0: 32 | 1 bytes, at 0: 33"});
  (*n.mutable_descriptors())["z"] = "";
  EXPECT_EQ(diff_messages(m, n, {.ignore = {"descriptors.y"}}).count, 1u);
}

TEST(MessageDiff, LongTextsAreShownWhereTheyDiffer) {
  v1::JointState a, b;
  a.set_fault(std::string(500, 'x') + "here");
  b.set_fault(std::string(500, 'x') + "there");
  const auto d = diff_messages(a, b, {});
  EXPECT_NE(d.fields.at(0).a.find("here"), std::string::npos);
  EXPECT_LT(d.fields.at(0).a.size(), 150u);
}

TEST(MessageDiff, DescribesSomeAndCountsAll) {
  const auto d = diff_messages(arm(std::vector<double>(50, 0.0)), arm(std::vector<double>(50, 1.0)),
                               {.limit = 3});
  EXPECT_EQ(d.fields.size(), 3u);
  EXPECT_EQ(d.count, 50u);
}

TEST(MessageDiff, RemembersTheWorstOfEachField) {
  WorstDifferences worst;
  const DiffRules loose{.tolerance = 10.0};
  EXPECT_TRUE(diff_messages(arm({1.0, 2.0}), arm({1.25, 4.0}), loose, &worst).equal());
  EXPECT_TRUE(diff_messages(arm({1.0, 2.0}), arm({2.5, 2.0}), loose, &worst).equal());
  ASSERT_EQ(worst.size(), 1u);
  EXPECT_EQ(worst.at("position_rad").difference, 2.0);
  EXPECT_EQ(worst.at("position_rad").path, "position_rad.1");
  EXPECT_EQ(worst.at("position_rad").b, "4");
  static_cast<void>(diff_messages(arm({kNan}), arm({0.0}), loose, &worst));
  EXPECT_EQ(worst.at("position_rad").difference, kInf);
}

/// Schema of `test.T` with the fields given, all double unless named otherwise.
log::Schema schema(const std::vector<std::pair<std::string, int>>& fields) {
  google::protobuf::FileDescriptorSet set;
  auto* file = set.add_file();
  file->set_name("t.proto");
  file->set_package("test");
  file->set_syntax("proto3");
  auto* type = file->add_message_type();
  type->set_name("T");
  for (const auto& [name, number] : fields) {
    auto* field = type->add_field();
    field->set_name(name);
    field->set_number(number);
    field->set_label(google::protobuf::FieldDescriptorProto::LABEL_OPTIONAL);
    field->set_type(name == "word" ? google::protobuf::FieldDescriptorProto::TYPE_STRING
                                   : google::protobuf::FieldDescriptorProto::TYPE_DOUBLE);
  }
  return {1, "test.T", "protobuf", set.SerializeAsString()};
}

/// A double field on the wire.
std::string wire(int number, double value) {
  std::string out(1, static_cast<char>(number << 3 | 1));
  const auto* bytes = reinterpret_cast<const char*>(&value);
  return out.append(bytes, sizeof value);
}

TEST(PayloadDiff, FieldsOfTwoVersionsAreMatchedByNumberAndOneThatWentDoesNotCount) {
  const log::Schema old_type = schema({{"bridge_m", 1}, {"gone", 2}}),
                    new_type = schema({{"bar_m", 1}});
  PayloadDiff diff;
  const DiffRules rules{.exact = true, .across_versions = true};
  EXPECT_TRUE(diff.diff({wire(1, 3.0) + wire(2, 1.0), &old_type}, {wire(1, 3.0), &new_type}, rules)
                  .equal());
  EXPECT_EQ(lines(diff.diff({wire(1, 3.0), &old_type}, {wire(1, 3.5), &new_type}, rules)),
            (Lines{"bridge_m: 3 | 3.5"}));
}

TEST(PayloadDiff, TypesOfTwoBuildsAreMatchedByName) {
  const log::Schema old_type = schema({{"x_m", 1}}), new_type = schema({{"y_m", 1}, {"x_m", 2}});
  PayloadDiff diff;
  EXPECT_TRUE(diff.diff({wire(1, 3.0), &old_type}, {wire(2, 3.0), &new_type}, {}).equal());
  const std::string both = wire(2, 3.5) + wire(1, 1.0);
  EXPECT_EQ(lines(diff.diff({wire(1, 3.0), &old_type}, {both, &new_type}, {})),
            (Lines{"x_m: 3 | 3.5", "y_m: no such field | 1"}));
  const log::Schema word = schema({{"x_m", 2}, {"word", 1}});
  EXPECT_EQ(lines(diff.diff({wire(2, 3.0), &word}, {wire(2, 3.0) + wire(9, 1.0), &word}, {})),
            Lines{"(unknown fields): 0 bytes, at 0: end | 9 bytes, at 0: 49 00 00 00 00 00 00 f0 "
                  "3f"});
}

TEST(PayloadDiff, WhatCannotBeDecodedDiffersInItsBytes) {
  const log::Schema type = schema({{"x_m", 1}});
  log::Schema json = type;
  json.encoding = "jsonschema";
  PayloadDiff diff;
  const Lines bytes{": 2 bytes, at 1: 62 | 2 bytes, at 1: 63"};
  EXPECT_EQ(lines(diff.diff({"ab"}, {"ac"}, {})), bytes);
  EXPECT_EQ(lines(diff.diff({"ab", &json}, {"ac", &json}, {})), bytes);
  EXPECT_EQ(lines(diff.diff({"ab", &type}, {"ac", &type}, {})), bytes);  // no message
  EXPECT_TRUE(diff.diff({"ab", &type}, {"ab", &type}, {}).equal());
}

TEST(PayloadDiff, ExactMeansTheBytes) {
  const log::Schema type = schema({{"x_m", 1}, {"y_m", 2}});
  const std::string a = wire(1, 1.0) + wire(2, 2.0), b = wire(2, 2.0) + wire(1, 1.0);
  PayloadDiff diff;
  EXPECT_TRUE(diff.diff({a, &type}, {b, &type}, {}).equal());
  const auto d = diff.diff({a, &type}, {b, &type}, {.exact = true});
  ASSERT_EQ(d.count, 1u);
  EXPECT_EQ(d.fields.at(0).path, "");
  EXPECT_TRUE(diff.diff({a, &type}, {b, &type}, {.ignore = {"y_m"}, .exact = true}).equal());
}

}  // namespace
}  // namespace mimesis::tool
