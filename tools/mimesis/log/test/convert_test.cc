// Logs of candump and LCM.
#include "tools/mimesis/log/convert.h"

#include <gtest/gtest.h>

#include "common/error.h"
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
                  const std::string& from = "") {
  const log::MemorySource source(bytes);
  *result = convert_log(
      source,
      {.input = "in", .output = {.path = folder.file("out.mcap"), .force = true}, .from = from});
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
  converted(folder, "can0 123 [0]\n(2.5) can0 123#\ncan0 123 [0]\n", &result, "candump");
  EXPECT_EQ(result.untimed, 2u);
}

std::string big_endian(std::uint64_t value, int size) {
  std::string out;
  for (int i = size - 1; i >= 0; --i) out += static_cast<char>(value >> (8 * i));
  return out;
}

std::string lcm_event(std::uint64_t number, std::uint64_t time_us, const std::string& channel,
                      const std::string& data) {
  return "\xED\xA1\xDA\x01" + big_endian(number, 8) + big_endian(time_us, 8) +
         big_endian(channel.size(), 4) + big_endian(data.size(), 4) + channel + data;
}

std::string lcm_data(std::uint64_t i) {
  return big_endian(0xFEEDFACECAFEBEEF, 8) + std::string(20, static_cast<char>('a' + i));
}

std::string lcm_log(std::uint64_t events) {
  std::string log;
  for (std::uint64_t i = 0; i < events; ++i) {
    log += lcm_event(i, 1'000'000 + 10 * i, i % 2 == 0 ? "POSE" : "ROBOT_STATE", lcm_data(i));
  }
  return log;
}

TEST(Convert, LcmKeepsChannelsTimesPayloadsAndFingerprint) {
  const TestFolder folder;
  ConvertResult result;
  const OpenLog log = converted(folder, lcm_log(5), &result);
  EXPECT_EQ(result.from, LogKind::lcm);
  EXPECT_EQ(result.damages + result.lost, 0u);
  ASSERT_EQ(log.summary.channels.size(), 2u);
  const log::Channel& channel = log.summary.channels.at(2);
  EXPECT_EQ(channel.topic, "ROBOT_STATE");
  EXPECT_EQ(channel.message_encoding, "lcm");
  EXPECT_EQ(channel.schema_id, 0);
  EXPECT_EQ(channel.metadata.at("lcm_fingerprint"), "feedfacecafebeef");
  log::IndexedReader reader(*log.source, log.summary);
  for (std::uint64_t i = 0; i < 5; ++i) {
    const log::Message* m = reader.next();
    ASSERT_NE(m, nullptr);
    EXPECT_EQ(m->log_time, 1'000'000'000 + 10'000 * i);
    EXPECT_EQ(m->sequence, i / 2 + 1);
    EXPECT_EQ(m->data, lcm_data(i));
  }
}

std::vector<std::uint64_t> lcm_numbers(const std::string& bytes, std::size_t* damages,
                                       std::uint64_t* lost = nullptr) {
  const log::MemorySource source(bytes);
  LcmReader reader(source);
  std::vector<std::uint64_t> numbers;
  while (const auto event = reader.next()) {
    EXPECT_EQ(event->data, lcm_data(event->number)) << "altered data was delivered";
    numbers.push_back(event->number);
  }
  *damages = reader.damages().size();
  if (lost != nullptr) *lost = reader.lost();
  return numbers;
}

TEST(LcmReader, GoesOnBehindDamageAndCountsWhatTheLoggerDropped) {
  const std::string whole = lcm_log(10);
  std::size_t damages = 0;
  std::uint64_t lost = 0;
  EXPECT_EQ(lcm_numbers(whole, &damages).size(), 10u);
  EXPECT_EQ(damages, 0u);

  const std::string dropped = lcm_event(3, 1, "A", lcm_data(3)) + lcm_event(7, 2, "A", lcm_data(7));
  EXPECT_EQ(lcm_numbers(dropped, &damages, &lost), (std::vector<std::uint64_t>{3, 7}));
  EXPECT_EQ(lost, 3u);
  EXPECT_EQ(damages, 0u);

  const std::string between = "garbage\xED\xA1" + lcm_log(3) + std::string(200'000, '\xED');
  EXPECT_EQ(lcm_numbers(between, &damages), (std::vector<std::uint64_t>{0, 1}));
  EXPECT_EQ(damages, 2u);
}

TEST(LcmReader, EveryDamagedLengthOrSyncWordIsReportedAndCostsTwoEventsAtMost) {
  const std::string whole = lcm_log(10);
  const std::size_t event = lcm_event(0, 0, "POSE", lcm_data(0)).size();
  for (std::size_t in_event = 0; in_event < 28; ++in_event) {
    if (in_event >= 4 && in_event < 20) continue;  // number and time: nothing covers them
    const std::size_t at = event + in_event;       // position in the second event
    for (const char bit : {'\x01', '\x10', '\x80'}) {
      std::string bytes = whole;
      bytes[at] = static_cast<char>(bytes[at] ^ bit);
      std::size_t damages = 0;
      const auto numbers = lcm_numbers(bytes, &damages);
      EXPECT_GE(numbers.size(), 8u) << at;
      EXPECT_EQ(damages, 1u) << at;
    }
  }
}

TEST(LcmReader, ACutFileGivesAllWholeEvents) {
  const std::string whole = lcm_log(4);
  std::vector<std::size_t> ends;
  for (std::size_t i = 1; i <= 4; ++i) ends.push_back(lcm_log(i).size());
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    std::size_t damages = 0;
    const auto numbers = lcm_numbers(whole.substr(0, size), &damages);
    const auto complete = static_cast<std::size_t>(
        std::ranges::count_if(ends, [&](std::size_t end) { return end <= size; }));
    EXPECT_EQ(numbers.size(), complete) << size;
    const bool at_end = size == 0 || std::ranges::find(ends, size) != ends.end();
    EXPECT_EQ(damages, at_end ? 0u : 1u) << size;
  }
}

TEST(Convert, OtherKindsAreNamed) {
  const auto why = [](const std::string& bytes) -> std::string {
    const log::MemorySource source(bytes);
    try {
      static_cast<void>(detect_kind(source, "file"));
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(why({"SQLite format 3\0xyz", 19}),
            "file: a rosbag2 of the sqlite3 kind: `ros2 bag convert` makes MCAP of it");
  EXPECT_EQ(why("#ROSBAG V2.0\n"), "file: a bag of ROS 1: `mcap convert` makes MCAP of it");
  EXPECT_NE(why("hello"), "");
  EXPECT_NE(why(""), "");
  EXPECT_EQ(why(kLog), "");
  EXPECT_EQ(why(kShown), "");
  EXPECT_EQ(why(lcm_log(1)), "");
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
