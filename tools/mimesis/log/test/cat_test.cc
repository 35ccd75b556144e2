// cat and info: their output for a log.
#include "tools/mimesis/log/cat.h"

#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/testing/refusal.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/field_text.h"
#include "tools/mimesis/log/info.h"
#include "tools/mimesis/log/test/tool_logs.h"

namespace mimesis::tool {
namespace {

using nlohmann::ordered_json;
using testlogs::log_bytes;

std::string json_text(const google::protobuf::Message& message, BytesText bytes) {
  std::string out;
  JsonText(out, bytes).message(message);
  return out;
}

TEST(JsonText, SaysTheSameAsMessageJson) {
  v1::NodeStart start;
  start.mutable_header()->set_stamp_ns(1ull << 63);
  start.set_node("quote \" slash \\ newline \n bell \a größe");
  start.add_inputs()->set_latched(true);
  v1::ReplayOutcome outcome;
  outcome.add_written()->set_data("abc");
  outcome.set_failed(true);
  v1::StepRecord step;
  step.set_kind(v1::STEP_KIND_STEP);
  step.add_taken()->set_seq(7);
  v1::LockstepJoin join;
  join.set_rate_hz(0.1);
  join.set_offset_s(NAN);
  for (const google::protobuf::Message* m :
       std::initializer_list<const google::protobuf::Message*>{&start, &outcome, &step, &join}) {
    EXPECT_EQ(ordered_json::parse(json_text(*m, BytesText::length)), to_json(*m));
  }
  join.set_offset_s(3.0);
  EXPECT_NE(json_text(join, BytesText::length).find("\"offset_s\":3.0"), std::string::npos);
  outcome.mutable_written(0)->set_data(std::string("\x00\xff\x10\x41", 4));
  EXPECT_EQ(ordered_json::parse(json_text(outcome, BytesText::hex))["written"][0]["data"],
            "00ff1041");
  EXPECT_EQ(ordered_json::parse(json_text(outcome, BytesText::base64))["written"][0]["data"],
            "AP8QQQ==");
  std::string out;
  JsonText(out, BytesText::length).string("a\xff\xc3\xa9\xed\xa0\x80z");
  EXPECT_EQ(out, "\"a\xEF\xBF\xBD\xc3\xa9\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBDz\"");
  for (const auto& [data, text] : std::vector<std::pair<std::string, std::string>>{
           {"", "\"\""}, {"M", "\"TQ==\""}, {"Ma", "\"TWE=\""}, {"Man", "\"TWFu\""}}) {
    out.clear();
    JsonText(out, BytesText::base64).bytes(data);
    EXPECT_EQ(out, text);
  }
}

using Cat = testlogs::ToolLogs;

TEST_F(Cat, OneObjectPerMessageInTheOrderOfLogTime) {
  CatOptions options;
  options.files = {
      save("b.mcap", log_bytes({{"b/out", "b", 9, 30}})),
      save("a.mcap", log_bytes({{"a/out", "a", 1, 10, "one"}, {"a/out", "a", 2, 40}}))};
  const auto lines = cat(options);
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0].dump(),
            R"({"topic":"a/out","node":"a","seq":1,"log_time_ns":10,"publish_time_ns":9,)"
            R"("message":{"topic":"one","start_id":0,"seq":1,"latched":false}})");
  EXPECT_EQ(lines[1]["topic"], "b/out");
  options.limit = 2;
  EXPECT_EQ(cat(options).size(), 2u);
  options.limit = 0;
  options.range.start = "30ns";
  EXPECT_EQ(cat(options).size(), 2u);
  options.range.end = "40ns";
  EXPECT_EQ(cat(options).size(), 1u);
}

TEST_F(Cat, FieldsOnlyAndMistakesInTheirNames) {
  CatOptions options;
  options.files = {save("a.mcap", log_bytes({{"a/out", "a", 5, 10, "one"}}))};
  options.fields = {"topic", "seq"};
  EXPECT_EQ(cat(options)[0]["fields"].dump(), R"({"topic":"one","seq":5})");
  options.fields = {"sequ"};
  const std::string refused = testing::refusal([&] { cat(options); });
  EXPECT_EQ(refused, "mimesis.v1.Publication has no field 'sequ', did you mean 'seq'?");
}

TEST_F(Cat, ForeignEncodings) {
  std::string bytes;
  log::MemorySink sink(bytes);
  log::Writer writer(sink, {.background = false});
  ASSERT_TRUE(writer.add_channel(0, "json", "json", {}));
  ASSERT_TRUE(writer.add_channel(0, "cdr", "cdr", {}));
  ASSERT_TRUE(writer.write({1, 1, 1, 1, "{\"a\":\n1}"}));
  ASSERT_TRUE(writer.write({1, 2, 2, 2, "{"}));
  ASSERT_TRUE(writer.write({2, 1, 3, 3, "1234"}));
  ASSERT_TRUE(writer.finish());
  CatOptions options;
  options.files = {save("a.mcap", bytes)};
  const auto lines = cat(options);
  EXPECT_EQ(lines[0]["message"].dump(), R"({"a":1})");
  EXPECT_EQ(lines[1]["message"].dump(), R"({"bytes":1})");
  EXPECT_EQ(lines[2]["message"].dump(), R"({"bytes":4})");
}

TEST(LogTime, SecondsNanosecondsAndUtc) {
  const Span span{5'000'000'000, 9'000'000'000};
  EXPECT_EQ(parse_log_time("--start", "1.5", span), 6'500'000'000u);
  EXPECT_EQ(parse_log_time("--start", "2min", span), 125'000'000'000u);
  EXPECT_EQ(parse_log_time("--start", "1500ns", span), 1500u);
  EXPECT_EQ(parse_log_time("--start", "1970-01-02T00:00:01.5Z", span), 86401'500'000'000u);
  EXPECT_EQ(parse_log_time("--start", "2026-11-21 15:40:00", span), 1795275600'000'000'000u);
  for (const char* bad : {"", "-1", "x", "2026-13-01T00:00:00Z", "2026-11-21", "1e99", "5 ns"}) {
    EXPECT_THROW(parse_log_time("--start", bad, span), ConfigError) << bad;
  }
}

TEST_F(Cat, InfoOfPartsIsOneLog) {
  testlogs::LogOptions options;
  options.metadata = {{kCountsName, {{"a/out (a)", "received=2 lost=3"}}},
                      {"mimesis.run", {{"host", "h"}}}};
  std::vector<OpenLog> logs;
  logs.push_back(open_log(save(
      "0.mcap",
      log_bytes({{"a/out", "a", 1, 1'000'000'000}, {"a/out", "a", 2, 2'000'000'000}}, options))));
  logs.push_back(open_log(
      save("1.mcap", log_bytes({{"a/out", "a", 6, 5'000'000'000, "x", false, "7"}}, options))));
  const auto json = info_json(logs, true);
  EXPECT_EQ(json["messages"], 3);
  EXPECT_EQ(json["lost"], 6);
  EXPECT_EQ(json["duration_s"], 4.0);
  EXPECT_EQ(json["files"].size(), 2u);
  ASSERT_EQ(json["topics"].size(), 1u);
  EXPECT_EQ(json["topics"][0]["messages"], 3);
  EXPECT_EQ(json["topics"][0]["rate_hz"], 0.75);
  EXPECT_EQ(json["topics"][0]["bytes"], 15);  // field, length, "x"; field, number
  EXPECT_EQ(json["nodes"][0]["starts"].size(), 1u);
  EXPECT_EQ(json["metadata"].size(), 2u);  // each once
  const std::string text = info_text(logs, info_json(logs, false), false);
  EXPECT_NE(text.find("host: h"), std::string::npos);
  EXPECT_NE(text.find("a/out  mimesis.v1.Publication  a     3         6     0.8"),
            std::string::npos)
      << text;
}

}  // namespace
}  // namespace mimesis::tool
