// filter: what stands in the new log.
#include "tools/mimesis/log/rewrite.h"

#include <algorithm>

#include "common/error.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/log/test/tool_logs.h"

namespace mimesis::tool {
namespace {

using testlogs::log_bytes;
using testlogs::read_log;
using testlogs::Sent;
using Strings = std::vector<std::string>;

constexpr std::uint64_t kSecond = 1'000'000'000;

class Rewrite : public testlogs::ToolLogs {
 protected:
  /// Ten seconds: a/out at 10 Hz, b/out at 1 Hz, a latched state at 0 and 5 s.
  std::vector<Sent> ten_seconds() {
    std::vector<Sent> all;
    for (std::uint32_t i = 0; i < 100; ++i) {
      const std::uint64_t time = kSecond + i * kSecond / 10;
      all.push_back({"a/out", "a", i + 1, time});
      if (i % 10 == 0) all.push_back({"b/out", "b", i / 10 + 1, time});
      if (i % 50 == 0) {
        all.push_back({"a/state", "a", i / 50 + 1, time, "s" + std::to_string(i), true});
      }
    }
    return all;
  }
  FilterOptions filter(const std::string& in) {
    FilterOptions options;
    options.inputs = {in};
    options.output.path = path("out.mcap");
    options.output.force = true;
    return options;
  }
  std::vector<Sent> out() { return read_log(path("out.mcap")); }
};

TEST_F(Rewrite, FilterKeepsOrderTimesAndNumbersOfTheChosenTopics) {
  const auto sent = ten_seconds();
  auto options = filter(save("in.mcap", log_bytes(sent, {.attachment = "nodes: {}"})));
  EXPECT_EQ(log_filter(options), 0);
  EXPECT_EQ(out(), sent);

  options.topics = {"b/out"};
  EXPECT_EQ(log_filter(options), 0);
  std::vector<Sent> expected;
  for (const Sent& m : sent) {
    if (m.topic == "b/out") expected.push_back(m);
  }
  EXPECT_EQ(out(), expected);
  EXPECT_EQ(open_log(path("out.mcap")).summary.attachments.size(), 1u);

  options.topics = {};
  options.nodes = {"b"};
  options.attachments = false;
  EXPECT_EQ(log_filter(options), 0);
  EXPECT_EQ(out(), expected);
  EXPECT_EQ(open_log(path("out.mcap")).summary.attachments.size(), 0u);
}

TEST_F(Rewrite, ALaterStartBeginsWithTheLatchedValueOfThatTime) {
  auto options = filter(save("in.mcap", log_bytes(ten_seconds())));
  options.range = {.start = "7.05", .end = {}, .duration = "0.2"};
  EXPECT_EQ(log_filter(options), 0);
  EXPECT_EQ(out(), (std::vector<Sent>{{"a/state", "a", 2, kSecond + 7'050'000'000, "s50", true},
                                      {"a/out", "a", 72, kSecond + 7'100'000'000},
                                      {"a/out", "a", 73, kSecond + 7'200'000'000}}));
  options.latched = false;
  options.range = {.start = "8050000000ns", .end = "8150000000ns", .duration = {}};
  EXPECT_EQ(log_filter(options), 0);
  EXPECT_EQ(out(), (std::vector<Sent>{{"a/out", "a", 72, 8'100'000'000}}));
  options.range = {.start = "3", .end = "2", .duration = {}};
  EXPECT_THROW(log_filter(options), ConfigError);
}

TEST_F(Rewrite, CountsOfAPartAreThoseOfThePart) {
  const log::Metadata counts{kCountsName,
                             {{"a/out (a)", "received=3 lost=9"}, {"total", "received=3 lost=9"}}};
  auto options = filter(save(
      "in.mcap", log_bytes({{"a/out", "a", 7, 10}, {"a/out", "a", 8, 20}, {"a/out", "a", 11, 30}},
                           {.metadata = {counts}})));
  const auto losses = [&] {
    std::vector<OpenLog> logs;
    logs.push_back(open_log(path("out.mcap")));
    return *read_losses(logs);
  };
  EXPECT_EQ(log_filter(options), 0);
  EXPECT_EQ(losses(), (LossCounts{{"a/out (a)", {3, 9}}}));
  options.range.start = "20ns";
  EXPECT_EQ(log_filter(options), 0);
  EXPECT_EQ(losses(), (LossCounts{{"a/out (a)", {2, 2}}}));
}

TEST_F(Rewrite, WhatAReplayNeedsIsFoundByNodeStart) {
  v1::NodeStart start;
  start.add_inputs()->set_topic("camera/image");
  start.add_outputs()->set_topic("planner/command");
  std::string bytes;
  log::MemorySink sink(bytes);
  log::Writer writer(sink, {.background = false});
  std::uint16_t id = 0;
  for (const char* topic : {"planner/start", "planner/steps", "camera/image", "planner/command",
                            "planner/health", "arm/state"}) {
    id = writer.add_channel(0, topic, "protobuf", {{"node", "x"}}).value();
    const std::string data = id == 1 ? start.SerializeAsString() : "";
    ASSERT_TRUE(writer.write({id, 1, id, id, data}));
  }
  ASSERT_TRUE(writer.finish());
  auto options = filter(save("in.mcap", bytes));
  options.inputs_of = "planner";
  EXPECT_EQ(log_filter(options), 0);
  Strings topics;
  const auto filtered = open_log(path("out.mcap"));
  for (const auto& [ignored, channel] : filtered.summary.channels) {
    topics.push_back(channel.topic);
  }
  EXPECT_EQ(topics, (Strings{"planner/start", "planner/steps", "camera/image", "planner/command"}));
  options.inputs_of = "planer";
  try {
    log_filter(options);
    FAIL();
  } catch (const VerbEnd& end) {
    EXPECT_EQ(end.exit_code, 3);
    EXPECT_EQ(end.line, "--inputs-of: the log has no planer/start, did you mean 'planner'?");
  }
}

TEST_F(Rewrite, MergedPartsAreTheRecordingThatWasSplit) {
  const auto sent = ten_seconds();
  std::vector<Sent> first(sent.begin(), sent.begin() + 70), second(sent.begin() + 70, sent.end());
  Sent repeated = first[60];  // the last latched one
  for (const Sent& m : first) {
    if (m.latched) repeated = m;
  }
  testlogs::LogOptions counts;
  counts.metadata = {{kCountsName, {{"a/out (a)", "received=50 lost=1"}}}};
  const std::string a = save("run_000.mcap", log_bytes(first, counts));
  second.insert(second.begin(), repeated);
  const std::string b = save("run_001.mcap", log_bytes(second, counts));
  auto options = filter(a);
  options.inputs = {a, b};
  // The writer of the sample keeps the publish time at log time - 1: the repetition is the same.
  EXPECT_EQ(log_filter(options), 0);
  const auto merged = out();
  EXPECT_EQ(merged.size(), sent.size());
  EXPECT_TRUE(std::ranges::is_sorted(merged, {}, &Sent::time));
  const auto log = open_log(path("out.mcap"));
  EXPECT_EQ(log.summary.channels.size(), 3u);
  EXPECT_EQ(log.summary.schemas.size(), 1u);
  std::vector<OpenLog> logs;
  logs.push_back(open_log(path("out.mcap")));
  EXPECT_EQ(read_losses(logs)->at("a/out (a)"), (LossCount{100, 2}));
}

TEST_F(Rewrite, SetsClocksRightAndKeepsDifferentSchemasApart) {
  std::string other;
  log::MemorySink sink(other);
  log::Writer writer(sink, {.background = false});
  ASSERT_TRUE(writer.add_schema("mimesis.v1.Publication", "protobuf", "another build"));
  ASSERT_TRUE(writer.add_channel(1, "a/out", "protobuf", {{"node", "a"}, {"latched", "false"}}));
  ASSERT_TRUE(writer.write({1, 1, 2 * kSecond, 2 * kSecond, ""}));
  ASSERT_TRUE(writer.finish());
  auto options = filter("");
  options.inputs = {save("a.mcap", log_bytes({{"a/out", "a", 1, kSecond}})), save("b.mcap", other)};
  options.offsets = {path("b.mcap") + "=-1.5"};
  EXPECT_EQ(log_filter(options), 0);
  const auto messages = out();
  ASSERT_EQ(messages.size(), 2u);
  EXPECT_EQ(messages[0].time, kSecond / 2);
  EXPECT_EQ(messages[1].time, kSecond);
  EXPECT_EQ(open_log(path("out.mcap")).summary.schemas.size(), 2u);
  options.offsets = {"c.mcap=1.0"};
  EXPECT_THROW(log_filter(options), ConfigError);
}

TEST_F(Rewrite, DamagedInputsAreToldByTheExitCodeAndEqualInputsGiveEqualBytes) {
  std::string bytes = log_bytes(ten_seconds());
  auto options = filter(save("in.mcap", bytes));
  EXPECT_EQ(log_filter(options), 0);
  const std::string once = bytes_of("out.mcap");
  EXPECT_EQ(log_filter(options), 0);
  EXPECT_EQ(bytes_of("out.mcap"), once);

  bytes[400] = static_cast<char>(bytes[400] ^ 1);
  save("in.mcap", bytes);
  EXPECT_EQ(log_filter(options), 1);
  EXPECT_LT(out().size(), ten_seconds().size());
}

TEST_F(Rewrite, ALogStandsUnderItsNameOnlyWhenItIsWhole) {
  const std::string in = save("in.mcap", log_bytes(ten_seconds()));
  auto options = filter(in);
  save("out.mcap", "precious");
  options.output.force = false;
  EXPECT_THROW(log_filter(options), ConfigError);  // exists
  EXPECT_EQ(bytes_of("out.mcap"), "precious");
  options.output.path = in;
  options.output.force = true;
  EXPECT_THROW(log_filter(options), ConfigError);  // is the input
  options.output.path = path("out.mcap");
  options.topics = {"no/such"};
  EXPECT_THROW(log_filter(options), ConfigError);
  EXPECT_EQ(bytes_of("out.mcap"), "precious");
  options.output.path = "/dev/full";
  options.topics = {};
  EXPECT_THROW(log_filter(options), VerbEnd);
  EXPECT_EQ(files(), (Strings{"in.mcap", "out.mcap"}));  // no .part is left
  {
    NewLog abandoned({.path = path("new.mcap")}, std::vector<OpenLog>());
    EXPECT_EQ(files(), (Strings{"in.mcap", "new.mcap.part", "out.mcap"}));
  }
  EXPECT_EQ(files(), (Strings{"in.mcap", "out.mcap"}));
}

}  // namespace
}  // namespace mimesis::tool
