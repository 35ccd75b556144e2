// Order of played messages, without a graph: logs in memory.
#include "tools/mimesis/log/playback.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>

#include "common/log/writer.h"
#include "common/testing/refusal.h"

namespace mimesis::tool {
namespace {

constexpr std::uint64_t kSecond = 1'000'000'000, kBase = 100 * kSecond;

/// One part of a log. Times in seconds behind kBase.
struct Part {
  std::string bytes;
  log::MemorySink sink{bytes};
  log::Writer writer{sink, {.chunk_size = 60}};  // two or three messages
  std::map<std::string, std::uint16_t> schemas;

  std::uint16_t channel(const std::string& topic, const std::string& node, bool latched = false,
                        const std::string& start_id = "", const std::string& type = "test.Type",
                        const std::string& encoding = "protobuf") {
    if (!schemas.contains(type))
      schemas[type] = *writer.add_schema(type, encoding, "descriptors of " + type);
    std::map<std::string, std::string> metadata{{"node", node},
                                                {"latched", latched ? "true" : "false"}};
    if (!start_id.empty()) metadata["start_id"] = start_id;
    return *writer.add_channel(schemas[type], topic, encoding, metadata);
  }
  void put(std::uint16_t channel, std::uint32_t seq, double time_s, const std::string& payload) {
    put_again(channel, seq, time_s, time_s, payload);
  }
  /// A message of `published_s` once more, as at the head of a part.
  void put_again(std::uint16_t channel, std::uint32_t seq, double time_s, double published_s,
                 const std::string& payload) {
    const auto ns = [](double s) { return kBase + static_cast<std::uint64_t>(s * 1e9); };
    ASSERT_TRUE(writer.write({channel, seq, ns(time_s), ns(published_s) - 7, payload}));
  }
  OpenLog open() {
    EXPECT_TRUE(writer.finish());
    auto source = std::make_unique<log::MemorySource>(bytes);
    auto summary = log::summarize(*source);
    EXPECT_TRUE(summary);
    return {"part.mcap", std::move(source), *summary};
  }
};

std::vector<OpenLog> logs(std::initializer_list<Part*> parts) {
  std::vector<OpenLog> all;
  for (Part* part : parts) all.push_back(part->open());
  return all;
}

/// "payload payload": of the values; then of the messages up to the end.
std::string text(const std::vector<Played>& values) {
  std::string all;
  for (const Played& v : values) all += (all.empty() ? "" : " ") + v.payload;
  return all;
}
std::string rest(Playback& playback) {
  std::string all;
  for (Played p; playback.next(p);) all += (all.empty() ? "" : " ") + p.payload;
  return all;
}
/// From position `at_s`: latched values | messages.
std::string from(Playback& playback, double at_s) {
  const std::string latched = text(playback.seek(playback.log_time_ns(at_s)));
  return latched + "|" + rest(playback);
}

std::string problem(const std::function<void()>& action) {
  return testing::refusal([&] { action(); });
}

TEST(Playback, GoesByLogTimeThenByFile) {
  Part a, b;
  const auto in_a = a.channel("x", "n"), in_b = b.channel("y", "m");
  a.put(in_a, 1, 0.0, "a0");
  a.put(in_a, 2, 2.0, "a2");
  a.put(in_a, 3, 1.0, "a1");
  a.put(in_a, 4, 2.0, "A2");
  b.put(in_b, 1, 0.5, "b05");
  b.put(in_b, 2, 2.0, "b2");
  b.put(in_b, 3, 3.0, "b3");
  Playback playback(logs({&a, &b}), {});
  EXPECT_EQ(from(playback, 0.0), "|a0 b05 a1 a2 A2 b2 b3");
  EXPECT_EQ(from(playback, 2.0), "|a2 A2 b2 b3");  // a seek meets a message of its own time
  EXPECT_EQ(from(playback, 0.0), "|a0 b05 a1 a2 A2 b2 b3");
  ASSERT_EQ(playback.topics().size(), 2U);
  EXPECT_EQ(playback.topics()[0].type, "test.Type");
  EXPECT_EQ(playback.topics()[0].descriptors, "descriptors of test.Type");
  EXPECT_EQ(playback.position_s(kBase), 0.0);
  EXPECT_EQ(playback.position_s(kBase - 500'000'000), -0.5);
  EXPECT_EQ(playback.end_ns(), kBase + 3 * kSecond);
  EXPECT_DOUBLE_EQ(playback.position_s(kBase + kSecond / 2), 0.5);

  Played p;
  playback.seek(kBase);
  ASSERT_TRUE(playback.next(p));
  EXPECT_EQ(p.log_time_ns, kBase);
  EXPECT_EQ(p.publish_time_ns, kBase - 7);
  EXPECT_EQ(p.topic, &playback.topics()[0]);
}

TEST(Playback, ASeekGivesTheLastValueOfEveryLatchedTopicBefore) {
  Part part;
  const auto state = part.channel("state", "n", true), map = part.channel("map", "n", true);
  const auto never = part.channel("late", "n", true), out = part.channel("out", "n");
  part.put(map, 1, 0.0, "map");  // far back: found by looking back further and further
  part.put(state, 1, 0.0, "s1");
  for (std::uint32_t i = 1; i <= 100; ++i) part.put(out, i, i, fmt::format("o{}", i));
  part.put(state, 2, 90.0, "s2");
  part.put(state, 3, 99.0, "s3");
  part.put(never, 1, 99.5, "late");
  Playback playback(logs({&part}), {});
  EXPECT_TRUE(playback.topics()[0].latched);
  EXPECT_FALSE(playback.topics()[3].latched);
  EXPECT_EQ(from(playback, 98.5), "map s2|o99 s3 late o100");
  EXPECT_EQ(from(playback, 99.0), "map s2|o99 s3 late o100");  // strictly before
  EXPECT_EQ(from(playback, 99.2), "map s3|late o100");
  EXPECT_EQ(from(playback, 100.0), "map s3 late|o100");
  EXPECT_EQ(text(playback.seek(0)), "");
}

TEST(Playback, ForViewersASeekGivesTheLastMessageOfEveryTopicBefore) {
  Part part;
  const auto once = part.channel("scene", "n"), out = part.channel("out", "n");
  part.put(once, 1, 0.0, "scene");  // as `mimesis plan --scene` writes it: not latched, once
  for (std::uint32_t i = 1; i <= 100; ++i) part.put(out, i, i, fmt::format("o{}", i));
  Playback playback(logs({&part}), {.last_of_all = true});
  EXPECT_EQ(from(playback, 99.5), "scene o99|o100");
  EXPECT_EQ(text(playback.seek(0)), "");
  Playback usual(logs({&part}), {});
  EXPECT_EQ(from(usual, 99.5), "|o100");
}

TEST(Playback, ValuesRepeatedAtTheHeadOfAPartAreNotPlayedTwice) {
  for (const std::string start : {"", "77"}) {  // logs from before start ids, and ours
    Part one, two;
    const auto in_one = one.channel("state", "n", true, start);
    const auto in_two = two.channel("state", "n", true, start), out = two.channel("out", "n");
    one.put(in_one, 1, 0.0, "s1");
    one.put(in_one, 2, 1.0, "s2");
    two.put_again(in_two, 2, 2.0, 1.0, "s2");
    two.put(out, 1, 2.5, "o");
    two.put(in_two, 3, 3.0, "s3");
    Playback playback(logs({&one, &two}), {});
    EXPECT_EQ(from(playback, 0.0), "|s1 s2 o s3");
    EXPECT_EQ(from(playback, 1.5), "s2|o s3");  // not again behind the seek's own
    EXPECT_EQ(from(playback, 2.5), "s2|o s3");
  }
}

TEST(Playback, ARestartedPublisherIsHeardAgain) {
  Part told, untold;
  for (Part* part : {&told, &untold}) {
    const bool ids = part == &told;
    const auto first = part->channel("state", "n", true, ids ? "1" : "");
    const auto second = ids ? part->channel("state", "n", true, "2") : first;
    const auto other = part->channel("state", "m", true, ids ? "3" : "");
    part->put(first, 1, 0.0, "same");
    part->put(second, 1, 1.0, ids ? "same" : "new");  // counts from 1 again
    part->put(other, 1, 2.0, "other");
  }
  Playback with_ids(logs({&told}), {}), without(logs({&untold}), {});
  EXPECT_EQ(from(with_ids, 0.0), "|same same other");
  EXPECT_EQ(from(without, 0.0), "|same new other");
}

TEST(Playback, RepeatedPayloadsOfOtherTopicsStay) {
  Part part;
  const auto out = part.channel("out", "n"), unnumbered = part.channel("state", "", true);
  part.put(out, 1, 0.0, "x");
  part.put(out, 1, 1.0, "x");
  part.put(unnumbered, 0, 2.0, "y");  // logs of others know no seq
  part.put(unnumbered, 0, 3.0, "y");
  Playback playback(logs({&part}), {});
  EXPECT_EQ(from(playback, 0.0), "|x x y y");
}

TEST(Playback, StartEndAndDurationCutTheLog) {
  Part part;
  const auto out = part.channel("out", "n"), state = part.channel("state", "n", true);
  part.put(state, 1, 0.0, "s");
  for (std::uint32_t i = 1; i < 10; ++i) part.put(out, i, i, std::to_string(i));
  const auto cut = [&](const PlaybackOptions& options) {
    std::vector<OpenLog> all;
    auto source = std::make_unique<log::MemorySource>(part.bytes);
    auto summary = log::summarize(*source);
    all.push_back({"part.mcap", std::move(source), *summary});
    Playback playback(std::move(all), options);
    return from(playback, 0.0);  // not before the start
  };
  ASSERT_TRUE(part.writer.finish());
  EXPECT_EQ(cut({.range = {.start = "7"}}), "s|7 8 9");
  EXPECT_EQ(cut({.range = {.start = std::to_string(kBase + 8'000'000'000) + "ns"}}), "s|8 9");
  EXPECT_EQ(cut({.range = {.start = "2", .end = "4"}}), "s|2 3 4");
  EXPECT_EQ(cut({.range = {.start = "2", .duration = "1.5"}}), "s|2 3");
  EXPECT_EQ(cut({.range = {.start = "9", .duration = "9e9"}}), "s|9");
  EXPECT_EQ(problem([&] { cut({.range = {.start = "9.5"}}); }),
            "part.mcap: nothing of its 9.000 s lies between 9.500 s and 9.000 s");
}

TEST(Playback, WhatNodesSaidAboutThemselvesIsPlayedOnRequestOnly) {
  const auto play = [](const PlaybackOptions& options) {
    Part part;
    part.put(part.channel("n/out", "n"), 1, 0, "out");
    part.put(part.channel("n/health", "n", false, "", "mimesis.v1.Health"), 1, 1, "health");
    part.put(part.channel("n/log", "n", false, "", "foxglove.Log"), 1, 2, "log");
    part.put(part.channel("n/words", "n", false, "", "foxglove.Log"), 1, 3, "words");
    part.put(part.channel("n/start", "n", true, "", "mimesis.v1.NodeStart"), 1, 4, "start");
    part.put(part.channel("n/steps", "n", false, "", "mimesis.v1.StepLog"), 1, 5, "steps");
    part.put(part.channel("clock/time", "clock", false, "", "mimesis.v1.ClockTime"), 1, 6, "time");
    part.put(part.channel("motor/start", "", false, "", "std_msgs.Bool"), 1, 7, "button");
    Playback playback(logs({&part}), options);
    return from(playback, 0.0);
  };
  EXPECT_EQ(play({}), "|out words button");
  EXPECT_EQ(play({.about_nodes = true}), "|out health log words start steps button");
  EXPECT_EQ(play({.filter = TopicFilter({"n/health"}, "", "")}), "|health");  // by name
  EXPECT_EQ(play({.filter = TopicFilter({}, "n/.*", "")}), "|out words");
  EXPECT_EQ(problem([&] { play({.filter = TopicFilter({"clock/time"}, "", "")}); }),
            "part.mcap: none of its topics is selected");
}

TEST(Playback, NewNamesMayMeetIfTheTypesAgree) {
  const auto play = [](const std::vector<std::string>& rules) {
    Part part;
    part.put(part.channel("a", "n"), 1, 0, "a");
    part.put(part.channel("b", "n"), 1, 1, "b");
    part.put(part.channel("c", "n", false, "", "test.Other"), 1, 2, "c");
    Playback playback(logs({&part}), {.remap = PlayRemap(rules)});
    std::string names;
    playback.seek(0);
    for (Played p; playback.next(p);) names += p.topic->topic + " ";
    return names;
  };
  EXPECT_EQ(play({}), "a b c ");
  EXPECT_EQ(play({"a:=x/y"}), "x/y b c ");
  EXPECT_EQ(play({"a:=b"}), "b b c ");
  EXPECT_EQ(play({"a:=b", "b:=a"}), "b a c ");
  EXPECT_EQ(
      problem([&] { play({"a:=c"}); }),
      "topic c has two types in part.mcap: test.Type and test.Other; --exclude one or --remap "
      "it");
  EXPECT_EQ(problem([&] { play({"d:=e"}); }), "--remap 'd:=e': part.mcap has no such topic");
}

TEST(Playback, SaysWhatItCannotPlay) {
  Part part;
  part.put(part.channel("out", "n"), 1, 0, "x");
  part.put(part.channel("text", "n", false, "", "Text", "json"), 1, 0, "{}");
  const Playback playback(logs({&part}), {.filter = TopicFilter({"out", "text", "gone"}, "", "")});
  EXPECT_EQ(playback.notes(),
            (std::vector<std::string>{"part.mcap: no topic gone",
                                      "part.mcap: topic text is not Protobuf and not played"}));
}

TEST(Playback, DamageIsCountedOnceAndTheRestIsPlayed) {
  Part part;
  const auto out = part.channel("out", "n", true);
  for (std::uint32_t i = 0; i < 9; ++i)
    part.put(out, i + 1, i, std::string(40, static_cast<char>('0' + i)));
  ASSERT_TRUE(part.writer.finish());
  log::MemorySource whole(part.bytes);
  const auto summary = log::summarize(whole);
  ASSERT_TRUE(summary);
  ASSERT_GE(summary->segments.size(), 4U);
  const log::ChunkIndex& chunk = summary->segments[2].index;
  const std::uint64_t lost = (chunk.message_end_time - chunk.message_start_time) / kSecond + 1;
  part.bytes[chunk.chunk_start_offset + chunk.chunk_length - 1] ^= 1;
  std::vector<OpenLog> all;
  all.push_back({"part.mcap", std::make_unique<log::MemorySource>(part.bytes), *summary});
  Playback playback(std::move(all), {});
  for (int pass = 0; pass < 2; ++pass) {
    playback.seek(kBase + 8 * kSecond);  // reads the damaged one as well
    playback.seek(0);
    std::size_t played = 0;
    for (Played p; playback.next(p);) ++played;
    EXPECT_EQ(played, 9U - lost);
    EXPECT_EQ(playback.report_damages(), 1U);
  }
}

TEST(PlayRemap, WholeNamesBeforePrefixesAndLongOnesBeforeShort) {
  const PlayRemap remap({"cam/:=c/", "cam/left/:=l/", "cam/left/image:=image", "/:=old/"});
  EXPECT_EQ(remap("cam/info"), "c/info");
  EXPECT_EQ(remap("cam/left/info"), "l/info");
  EXPECT_EQ(remap("cam/left/image"), "image");
  EXPECT_EQ(remap("camera"), "old/camera");
  EXPECT_EQ(PlayRemap({"old/:=/"})("old/camera"), "camera");
  EXPECT_EQ(PlayRemap()("camera"), "camera");
  EXPECT_EQ(remap.unused({"cam/x", "y"}),
            (std::vector<std::string>{"cam/left/:=l/", "cam/left/image:=image"}));
}

TEST(PlayRemap, RulesThatAreNone) {
  for (const std::string rule : {"a", "a=b", ":=b", "a:=", "a/:=b", "a:=b/"}) {
    EXPECT_EQ(problem([&] { const PlayRemap remap({rule}); }),
              "--remap '" + rule + "': expected OLD:=NEW, or OLD/:=NEW/ for a prefix");
  }
  EXPECT_EQ(problem([] {
              const PlayRemap remap({"a:=b", "a:=c"});
            }),
            "--remap 'a:=c': 'a:=b' says otherwise");
}

TEST(Playback, PlaysTopicsOfRos2AsProtobufOfTheSameFields) {
  Part part;
  const auto schema = *part.writer.add_schema("a/msg/B", "ros2msg", "int32 x");
  const auto none = *part.writer.add_schema("a/msg/C", "ros2msg", "int32");
  const auto b = *part.writer.add_channel(schema, "/ns/b", "cdr", {});
  (void)part.writer.add_channel(none, "/c", "cdr", {});
  part.put(b, 1, 1.0, std::string("\0\1\0\0\7\0\0\0", 8));
  part.put(b, 2, 2.0, std::string("\0\1\0\0\7", 5));  // cut: left out
  Playback playback(logs({&part}), {});
  ASSERT_EQ(playback.topics().size(), 1u);
  EXPECT_EQ(playback.topics()[0].topic, "ns/b");
  EXPECT_EQ(playback.topics()[0].type, "a_B");
  ASSERT_EQ(playback.notes().size(), 1u);
  EXPECT_NE(playback.notes()[0].find("topic /c (a/msg/C) is not played: line 1"),
            std::string::npos);
  (void)playback.seek(0);
  EXPECT_EQ(rest(playback), "\x08\x07");
}

}  // namespace
}  // namespace mimesis::tool
