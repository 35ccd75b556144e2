// Logs of candump.
#include "tools/mimesis/log/convert.h"

#include <gtest/gtest.h>

#include "common/error.h"
#include "common/testing/refusal.h"
#include "tools/mimesis/log/test/log_builder.h"

namespace mimesis::tool {
namespace {

/// Made by hand from the format; `log2long` of can-utils 2020.11 reads each line, and its output
/// is kShown below.
const std::string kLog =
    "(1436509052.249713) vcan0 044#2A366C2BBA\n"
    "(1436509052.449847) vcan0 0F6#7ADFE07BD2\n"
    "(1436509052.650004) can1 12345678#DEADBEEF\n"
    "(1436509052.850139) can1 123#R\n"
    "(1436509053.000000) can1 00000123#R4\n"
    "(1436509053.100000) can1 20000080#0000000000000000\n"
    "(1436509053.200000) can0 123##0112233445566778899AABBCC\n"
    "(1436509053.300000) can0 7FF#\n";
const std::string kShown =
    "(1436509052.249713)  vcan0       044   [5]  2A 36 6C 2B BA            '*6l+.'\n"
    "(1436509052.449847)  vcan0       0F6   [5]  7A DF E0 7B D2            'z..{.'\n"
    "(1436509052.650004)  can1  12345678   [4]  DE AD BE EF               '....'\n"
    "(1436509052.850139)  can1       123   [0]  remote request\n"
    "(1436509053.000000)  can1  00000123   [4]  remote request\n"
    "(1436509053.100000)  can1  20000080   [8]  00 00 00 00 00 00 00 00   ERRORFRAME\n"
    "(1436509053.200000)  can0       123  [12]  11 22 33 44 55 66 77 88 99 AA BB CC\n"
    "(1436509053.300000)  can0       7FF   [0]                            ''\n";

v1::CanFrame frame(const std::string& line) {
  const auto parsed = parse_candump(line);
  EXPECT_TRUE(parsed && *parsed) << line;
  return (*parsed)->frame;
}

TEST(Candump, FieldsOfEachKindOfFrame) {
  const auto plain = parse_candump("(1436509052.249713) vcan0 044#2A366C2BBA");
  ASSERT_TRUE(plain && *plain);
  EXPECT_EQ((*plain)->time_ns, 1'436'509'052'249'713'000u);
  const v1::CanFrame& f = (*plain)->frame;
  EXPECT_EQ(f.bus(), "vcan0");
  EXPECT_EQ(f.id(), 0x44u);
  EXPECT_EQ(f.data(), "\x2a\x36\x6c\x2b\xba");
  EXPECT_FALSE(f.extended() || f.remote() || f.error() || f.fd());

  const v1::CanFrame extended = frame("(1.0) can1 12345678#DE.AD");
  EXPECT_TRUE(extended.extended());
  EXPECT_EQ(extended.id(), 0x12345678u);
  EXPECT_EQ(extended.data(), "\xde\xad");
  const v1::CanFrame remote = frame("(1.0) can1 00000123#R4");
  EXPECT_TRUE(remote.remote() && remote.extended());
  EXPECT_EQ(remote.remote_length(), 4u);
  const v1::CanFrame error = frame("(1.0) can1 20000080#0000000000000000");
  EXPECT_TRUE(error.error());
  EXPECT_FALSE(error.extended());
  EXPECT_EQ(error.id(), 0x80u);
  const v1::CanFrame fd = frame("(1.0) can0 123##3AABB");
  EXPECT_TRUE(fd.fd());
  EXPECT_EQ(fd.fd_flags(), 3u);
  EXPECT_EQ(fd.data(), "\xaa\xbb");
  EXPECT_EQ(frame("(1.0) can0 123#1122334455667788_E").raw_length(), 14u);
}

TEST(Candump, WhatIsShownOnATerminal) {
  const auto untimed = parse_candump("  vcan0  044   [5]  2A 36 6C 2B BA");
  ASSERT_TRUE(untimed && *untimed);
  EXPECT_FALSE((*untimed)->time_ns);
  EXPECT_EQ((*untimed)->frame.data(), "\x2a\x36\x6c\x2b\xba");
  EXPECT_EQ(frame(" (000.001000)  can0  TX - -  044   [1]  2A").id(), 0x44u);
  EXPECT_TRUE(frame("  can0  123  [08]  11 22 33 44 55 66 77 88").fd());
  EXPECT_FALSE(frame("  can0  123   [8]  11 22 33 44 55 66 77 88").fd());
  for (const char* nothing : {"", "  ", "\r", "\tcontroller-problem{tx-error-warning}"}) {
    const auto parsed = parse_candump(nothing);
    EXPECT_TRUE(parsed && !*parsed) << nothing;
  }
}

TEST(Candump, MistakesSayWhatWasExpected) {
  const auto why = [](const std::string& line) {
    const auto parsed = parse_candump(line);
    return parsed ? "" : parsed.error().reason;
  };
  EXPECT_EQ(why("(1.x) can0 123#"), "'(1.x)' is no time: expected (SECONDS.MICROSECONDS)");
  EXPECT_EQ(why("(1.0) can0"), "expected (TIME) INTERFACE ID#DATA");
  EXPECT_EQ(why("(1.0) can0 123"), "'123': expected ID#DATA");
  EXPECT_EQ(why("(1.0) can0 12#00"), "'12' is no identifier: expected 3 or 8 hexadecimal digits");
  for (const char* bad : {"(1.0) can\xff 123#00",
                          "(1.0) a-name-of-sixteen 123#00",
                          "(1.0) can0 800#",
                          "(1.0) can0 12x#",
                          "(1.0) can0 123#0",
                          "(1.0) can0 123#001122334455667788",
                          "(1.0) can0 123#R9",
                          "(1.0) can0 123##",
                          "(1.0) can0 123##G",
                          "(1.0) can0 123#1_8",
                          "(1.0) can0 F2345678#",
                          "(99999999999.0) can0 123#",
                          "(1.0123456789) can0 123#",
                          "()",
                          "(",
                          "can0 123#00",
                          "can0 123 [x] 00",
                          "can0 123 [2] 00",
                          "can0 123 [9] 00",
                          "can0 123 [65] 00",
                          "can0 [1] 00",
                          "[1]",
                          "a [1] b [1]",
                          "can0 123 [1] xx"}) {
    EXPECT_NE(why(bad), "") << bad;
  }
}

/// Converts bytes to a log in `folder` and opens that.
OpenLog converted(const TestFolder& folder, const std::string& bytes, ConvertResult* result,
                  bool candump = false) {
  const log::MemorySource source(bytes);
  *result = convert_log(source, {.input = "in",
                                 .output = {.path = folder.file("out.mcap"), .force = true},
                                 .candump = candump});
  return open_log(folder.file("out.mcap"));
}

TEST(Convert, CandumpThereAndBack) {
  const TestFolder folder;
  for (const std::string& text : {kLog, kShown}) {
    ConvertResult result;
    const OpenLog log = converted(folder, text, &result);
    EXPECT_EQ(result.from, LogKind::candump);
    EXPECT_EQ(result.messages, 8u);
    EXPECT_EQ(result.damages, 0u);
    ASSERT_EQ(log.summary.channels.size(), 3u);
    EXPECT_EQ(log.summary.channels.at(1).topic, "can/vcan0");
    EXPECT_EQ(log.summary.schemas.at(1).name, "mimesis.v1.CanFrame");
    EXPECT_EQ(log.summary.statistics.channel_message_counts.at(2), 4u);
    EXPECT_EQ(log.summary.statistics.message_start_time, 1'436'509'052'249'713'000u);
    static_cast<void>(convert_log(
        *log.source,
        {.input = log.path, .output = {.path = folder.file("back.log"), .force = true}}));
    EXPECT_EQ(folder.read("back.log"), kLog);
  }
}

TEST(Convert, TheInputIsNeverOverwritten) {
  const TestFolder folder;
  ConvertResult result;
  const OpenLog log = converted(folder, kLog, &result);
  const std::string before = folder.read("out.mcap");
  EXPECT_THROW(static_cast<void>(convert_log(
                   *log.source, {.input = log.path, .output = {.path = log.path, .force = true}})),
               ConfigError);
  EXPECT_EQ(folder.read("out.mcap"), before);
}

TEST(Convert, DamagedLinesAreCountedAndTheRestKept) {
  const TestFolder folder;
  ConvertResult result;
  const std::string text =
      "(1.0) can0 123#00\n(1.1) can0 1z3#00\n" + std::string(10'000, 'x') + "\n(1.2) can0 123#01";
  ::testing::internal::CaptureStderr();
  const OpenLog log = converted(folder, text, &result);
  const std::string says = ::testing::internal::GetCapturedStderr();
  EXPECT_EQ(result.messages, 2u);
  EXPECT_GE(result.damages, 2u);
  EXPECT_TRUE(says.starts_with("in:2: '1z3' is no identifier")) << says;
  EXPECT_EQ(log.summary.statistics.message_end_time, 1'200'000'000u);
  converted(folder, "can0 123 [0]\n(2.5) can0 123#\ncan0 123 [0]\n", &result, true);
  EXPECT_EQ(result.untimed, 2u);
}

TEST(Convert, OtherKindsAreNamed) {
  const auto why = [](const std::string& bytes) -> std::string {
    const log::MemorySource source(bytes);
    return testing::refusal([&] { static_cast<void>(detect_kind(source, "file")); });
  };
  EXPECT_EQ(why({"SQLite format 3\0xyz", 19}),
            "file: a rosbag2 of the sqlite3 kind: `ros2 bag convert` makes MCAP of it");
  EXPECT_EQ(why("#ROSBAG V2.0\n"), "file: a bag of ROS 1: `mcap convert` makes MCAP of it");
  EXPECT_NE(why("hello"), "");
  EXPECT_NE(why(""), "");
  EXPECT_EQ(why(kLog), "");
  EXPECT_EQ(why(kShown), "");
  EXPECT_EQ(why("\xED\xA1\xDA\x01"), "file: a log of LCM, which is not supported");
}

TEST(Convert, AnOutputThatExistsIsKept) {
  const TestFolder folder;
  const std::string out = folder.write("out.mcap", "mine");
  const log::MemorySource source(kLog);
  EXPECT_THROW(static_cast<void>(convert_log(source, {.input = "in", .output = {.path = out}})),
               ConfigError);
  EXPECT_EQ(folder.read("out.mcap"), "mine");
  LogBuilder none;
  none.add_bytes("x", 1, "y");
  const std::string mcap = folder.write("x.mcap", none.finish());
  const auto log = open_log(mcap);
  EXPECT_THROW(
      static_cast<void>(convert_log(*log.source, {.input = mcap, .output = {.path = "-"}})),
      ConfigError);
}

}  // namespace
}  // namespace mimesis::tool
