// TOPIC.FIELD as people write it.
#include "tools/mimesis/log/field_columns.h"

#include <gtest/gtest.h>

#include "common/error.h"
#include "common/testing/refusal.h"
#include "proto/bridge.pb.h"
#include "proto/foxglove/image.pb.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/field_text.h"

namespace mimesis::tool {
namespace {

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
