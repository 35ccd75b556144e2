// Comparing two logs.
#include "tools/mimesis/log/diff.h"

#include <gtest/gtest.h>

#include <tuple>

#include "common/testing/refusal.h"
#include "proto/bridge.pb.h"
#include "proto/planner.pb.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/log/test/log_builder.h"

namespace mimesis::tool {
namespace {

v1::JointState stamped_arm(double position, std::uint64_t stamp_ns = 0) {
  v1::JointState m;
  m.mutable_header()->set_stamp_ns(stamp_ns);
  m.add_position_rad(position);
  return m;
}

std::vector<StreamDiff> diff(LogBuilder& a, LogBuilder& b, const DiffOptions& options = {}) {
  const OpenLog in_a = a.open(), in_b = b.open();
  std::uint64_t damages = 0;
  auto streams = diff_logs(in_a, in_b, options, damages);
  EXPECT_EQ(damages, 0u);
  return streams;
}

/// A, B, equal, differing, only in A, only in B.
using Counts = std::vector<std::uint64_t>;
Counts counts(const StreamDiff& s) { return {s.a, s.b, s.equal, s.differing, s.only_a, s.only_b}; }

TEST(LogDiff, MatchesBySequenceWhateverTheTimes) {
  LogBuilder a, b;
  for (std::uint32_t i = 1; i <= 10; ++i) {
    if (i != 3) a.add("x/arm", 1000 * i, stamped_arm(i), i);
    if (i != 5 && i != 10) b.add("x/arm", 7'000'000 + 3000 * i, stamped_arm(i == 7 ? 7.5 : i), i);
  }
  const auto streams = diff(a, b);
  ASSERT_EQ(streams.size(), 1u);
  EXPECT_EQ(counts(streams[0]), (Counts{9, 8, 6, 1, 2, 1}));
  EXPECT_FALSE(streams[0].same());
  ASSERT_TRUE(streams[0].first);
  EXPECT_EQ(streams[0].first->sequence, 7u);
  EXPECT_EQ(streams[0].first->time_a_ns, 7000u);
  EXPECT_EQ(streams[0].first->difference.fields.at(0).path, "position_rad.0");
  EXPECT_EQ(streams[0].worst.at("position_rad").difference, 0.5);
}

TEST(LogDiff, NodesOfOneTopicAreApartAndForeignMessagesGoByOrder) {
  LogBuilder a, b;
  a.add("x/arm", 1, stamped_arm(1), 1, "one").add("x/arm", 2, stamped_arm(2), 1, "two");
  b.add("x/arm", 1, stamped_arm(2), 1, "two").add("x/arm", 2, stamped_arm(1), 1, "one");
  const auto streams = diff(a, b);
  ASSERT_EQ(streams.size(), 2u);
  EXPECT_TRUE(streams[0].same());
  EXPECT_TRUE(streams[1].same());

  LogBuilder c, d;
  for (LogBuilder* log : {&c, &d}) {
    const auto channel = log->writer().add_channel(0, "raw", "x", {}).value();
    for (const std::string bytes : {"1", "2", "3"}) {
      if (log == &c || bytes != "3") {
        ASSERT_TRUE(log->writer().write({channel, 0, 5, 5, bytes}));
      }
    }
  }
  EXPECT_EQ(counts(diff(c, d).at(0)), (Counts{3, 2, 2, 0, 1, 0}));
}

TEST(LogDiff, ARestartedNodeIsMatchedWithItsOwnRestart) {
  LogBuilder logs[2];
  for (std::uint16_t log = 0; log < 2; ++log) {
    log::Writer& writer = logs[log].writer();
    for (std::uint16_t start = 0; start < 2; ++start) {
      const std::string id = std::to_string(100 * log + 7 * start + 1);  // a number without meaning
      const auto channel =
          writer.add_channel(0, "x/y", "raw", {{"node", "x"}, {"start_id", id}}).value();
      const std::string bytes = start == 0 ? "first" : "second";
      for (std::uint32_t i = 1; i <= 3; ++i) ASSERT_TRUE(writer.write({channel, i, i, i, bytes}));
    }
  }
  const auto streams = diff(logs[0], logs[1]);
  ASSERT_EQ(streams.size(), 2u);
  EXPECT_EQ(counts(streams[0]), (Counts{3, 3, 3, 0, 0, 0}));
  EXPECT_EQ(counts(streams[1]), (Counts{3, 3, 3, 0, 0, 0}));
}

TEST(LogDiff, ATopicThatOneLogLacks) {
  LogBuilder a, b;
  a.add("x/arm", 1, stamped_arm(1)).add("y/arm", 1, stamped_arm(1));
  b.add("x/arm", 1, stamped_arm(1));
  const auto streams = diff(a, b);
  ASSERT_EQ(streams.size(), 2u);
  EXPECT_TRUE(streams[0].same());
  EXPECT_EQ(counts(streams[1]), (Counts{1, 0, 0, 0, 1, 0}));
  EXPECT_FALSE(streams[1].same());
}

TEST(LogDiff, OptionsForFieldsAndTimes) {
  const auto run = [](DiffOptions options) {
    LogBuilder a, b;
    a.add("x/arm", 10, stamped_arm(1.0, 5));
    b.add("x/arm", 11, stamped_arm(1.25, 6));
    return diff(a, b, options).at(0).same();
  };
  EXPECT_FALSE(run({}));
  EXPECT_FALSE(run({.tolerance = 0.25}));  // the stamp is an integer
  EXPECT_TRUE(run({.tolerance = 0.25, .ignore = {"x/arm.header.stamp_ns"}}));
  EXPECT_FALSE(run({.tolerance = 0.2, .ignore = {"x/arm.header.stamp_ns"}}));
  EXPECT_TRUE(run({.tolerance = 0.25, .field_tolerances = {"x/arm.header.stamp_ns=1"}}));
  EXPECT_TRUE(run({.ignore = {"*.header", "x/arm.position_rad[0]"}}));
  EXPECT_FALSE(run({.ignore = {"*.header", "x/arm.position_rad[1]"}}));
  EXPECT_FALSE(run({.ignore = {"*.header", "*.position_rad[*]"}, .times = true}));
}

TEST(LogDiff, MistakesInOptionsNameWhatIsThere) {
  const auto why = [](DiffOptions options) -> std::string {
    LogBuilder a, b;
    a.add("x/arm", 10, stamped_arm(1.0));
    b.add("x/arm", 10, stamped_arm(1.0));
    return testing::refusal([&] { diff(a, b, options); });
  };
  EXPECT_EQ(why({.ignore = {"x/arn.header"}}),
            "no topic 'x/arn' in the log, did you mean 'x/arm'?");
  EXPECT_EQ(
      why({.ignore = {"x/arm.positon_rad"}}),
      "x/arm: mimesis.v1.JointState has no field 'positon_rad', did you mean 'position_rad'?");
  EXPECT_EQ(why({.field_tolerances = {"x/arm.position_rad"}}),
            "--field-tolerance x/arm.position_rad: expected TOPIC.FIELD=NUMBER, 0 or more");
  EXPECT_NE(why({.ignore = {"*.nothing"}}), "");
  EXPECT_EQ(why({.ignore = {"*.header"}}), "");
}

TEST(LogDiff, TopicsOfTheRuntime) {
  for (const char* topic : {"a/health", "a/log", "a/steps", "a/start", "clock/time"}) {
    EXPECT_TRUE(is_runtime_topic(topic)) << topic;
  }
  EXPECT_FALSE(is_runtime_topic("world/state"));
  EXPECT_FALSE(is_runtime_topic("a/logs"));
  EXPECT_FALSE(is_runtime_topic("start"));
}

TEST(LogDiff, LockstepRunsAreComparedAsFarAsTheyCanBeEqual) {
  // Node a stops at 50 in one run, at 70 in the other; both plan for other times on the wall clock.
  LogBuilder a, b;
  for (auto [log, stop_ns, plan_s] : {std::tuple(&a, 50U, 0.25), std::tuple(&b, 70U, 0.5)}) {
    v1::TaskStatus status;
    status.set_plan_compute_s(plan_s);
    v1::StepLog steps;
    v1::StepRecord& stop = *steps.add_steps();
    stop.set_kind(v1::STEP_KIND_STOP);
    stop.set_time_ns(stop_ns);
    for (std::uint32_t t = 10; t < stop_ns; t += 10) log->add("x/arm", t, stamped_arm(t), t);
    log->add("x/status", 40, status).add("a/steps", stop_ns, steps, 1, "a");
    EXPECT_TRUE(log->writer().add_metadata({"mimesis.launch", {{"clock", "lockstep"}}}));
  }
  std::vector<OpenLog> logs_a, logs_b;
  logs_a.push_back(a.open());
  logs_b.push_back(b.open());
  EXPECT_TRUE(in_lockstep(logs_a));
  EXPECT_EQ(run_limit(logs_a, "").until_ns, 49u);
  EXPECT_EQ(run_limit(logs_b, "").until_ns, 69u);
  EXPECT_EQ(run_limit(logs_b, "x/status").until_ns, 40u);
  const auto different = [&](const DiffOptions& options) {
    std::uint64_t damages = 0;
    std::vector<std::string> topics;
    for (const StreamDiff& s : diff_logs(logs_a[0], logs_b[0], options, damages)) {
      if (!s.same()) topics.push_back(s.topic);
    }
    return topics;
  };
  using Topics = std::vector<std::string>;
  DiffOptions options;
  options.topic = [](const std::string& topic) { return !is_runtime_topic(topic); };
  EXPECT_EQ(different(options), (Topics{"x/arm", "x/status"}));
  options.end_ns = 50;
  EXPECT_EQ(different(options), (Topics{"x/status"}));
  options.wall_fields = false;
  EXPECT_EQ(different(options), Topics{});
}

}  // namespace
}  // namespace mimesis::tool
