// check: one break, one finding of its kind.
#include "tools/mimesis/log/check.h"

#include <algorithm>
#include <set>

#include "common/log/codec.h"
#include "tools/mimesis/log/test/tool_logs.h"

namespace mimesis::tool {
namespace {

using testlogs::log_bytes;
using testlogs::Sent;
using Kinds = std::multiset<std::string>;

std::vector<Sent> sample() {
  std::vector<Sent> all;
  for (std::uint32_t i = 0; i < 40; ++i) all.push_back({"a/out", "a", i + 1, 100 + i});
  return all;
}

CheckedLog check(const std::string& bytes) {
  Sequences sequences;
  return check_log("x.mcap", log::MemorySource(bytes), sequences);
}

/// "error seq-gap" ...
Kinds kinds(const CheckedLog& checked) {
  Kinds all;
  for (const Finding& f : checked.findings) {
    all.insert(std::string(word(f.severity)) + " " + std::string(f.kind));
  }
  return all;
}
Kinds kinds(const std::string& bytes) { return kinds(check(bytes)); }

/// Rewrites a record of the summary with other contents, and its sum.
template <class T, class Change>
std::string with_changed(std::string bytes, log::Opcode opcode, Change change) {
  log::Footer footer;
  const std::size_t end = bytes.size() - log::kFooterSize;
  EXPECT_TRUE(log::decode(std::string_view(bytes).substr(end + log::kRecordHead, 20), footer));
  for (std::size_t at = footer.summary_start; at < end;) {
    std::uint64_t length = 0;
    std::copy_n(bytes.data() + at + 1, 8, reinterpret_cast<char*>(&length));
    if (static_cast<log::Opcode>(bytes[at]) == opcode) {
      T record;
      EXPECT_TRUE(log::decode(std::string_view(bytes).substr(at + 9, length), record));
      change(record);
      std::string anew;
      log::append(anew, record);
      EXPECT_EQ(anew.size(), 9 + length);
      bytes.replace(at, anew.size(), anew);
      break;
    }
    at += 9 + length;
  }
  const std::size_t covered = bytes.size() - log::kMagic.size() - 4 - footer.summary_start;
  const std::uint32_t crc =
      log::crc32(0, std::string_view(bytes).substr(footer.summary_start, covered));
  std::copy_n(reinterpret_cast<const char*>(&crc), 4,
              bytes.data() + bytes.size() - log::kMagic.size() - 4);
  return bytes;
}

TEST(Check, AWholeLogIsWithoutFindings) {
  EXPECT_EQ(kinds(log_bytes(sample(), {.attachment = "x"})), Kinds{});
  EXPECT_EQ(check(log_bytes(sample())).statistics.message_count, 40u);
}

TEST(Check, NumbersAndTimesOfChannels) {
  auto gap = sample();
  gap.erase(gap.begin() + 10, gap.begin() + 13);
  const CheckedLog checked = check(log_bytes(gap));
  EXPECT_EQ(kinds(checked), Kinds{"warning seq-gap"});
  EXPECT_EQ(checked.findings[0].what,
            "a/out (a): 3 messages are missing in 1 gaps, first seq 14 after 10");
  auto repeated = sample();
  repeated[5].seq = 5;
  EXPECT_EQ(kinds(log_bytes(repeated)), (Kinds{"warning seq-repeated", "warning seq-gap"}));
  auto late = sample();
  late[5].time = 1;
  EXPECT_EQ(kinds(log_bytes(late)), (Kinds{"warning order", "info order"}));
  auto restarted = sample();
  for (std::size_t i = 20; i < 40; ++i) {
    restarted[i].seq = static_cast<std::uint32_t>(i - 19);
    restarted[i].start_id = "2";
  }
  EXPECT_EQ(kinds(log_bytes(restarted)), Kinds{});
}

TEST(Check, ContentsAndSchemas) {
  std::string bytes;
  log::MemorySink sink(bytes);
  log::Writer writer(sink, {.background = false});
  const auto* type = v1::Publication::descriptor();
  ASSERT_TRUE(writer.add_schema(type->full_name(), "protobuf", runtime::descriptor_set(*type)));
  ASSERT_TRUE(writer.add_schema("test.Nothing", "protobuf", "nothing"));
  ASSERT_TRUE(writer.add_channel(1, "a", "protobuf", {}));
  ASSERT_TRUE(writer.add_channel(2, "b", "protobuf", {}));
  ASSERT_TRUE(writer.add_channel(0, "c", "json", {}));
  ASSERT_TRUE(writer.add_channel(0, "d", "cdr", {}));
  ASSERT_TRUE(writer.add_channel(0, "e", "json", {}));
  ASSERT_TRUE(writer.write({1, 1, 1, 1, "\xff\xff"}));
  ASSERT_TRUE(writer.write({1, 2, 2, 2, "\xf8\x07\x01"}));  // field 127
  ASSERT_TRUE(writer.write({3, 1, 3, 3, "{"}));
  ASSERT_TRUE(writer.write({4, 1, 4, 4, "?"}));
  ASSERT_TRUE(writer.write({5, 1, 5, 5, std::string(300'000, '[') + std::string(300'000, ']')}));
  ASSERT_TRUE(writer.finish());
  EXPECT_EQ(kinds(bytes),
            (Kinds{"error content", "error content", "error schema", "warning content",
                   "info encoding", "info no-messages", "info unknown-fields"}));
}

TEST(Check, TheSummaryAgainstTheData) {
  const std::string good = log_bytes(sample(), {.attachment = "x"});
  const auto statistics = [&](auto change) {
    return kinds(with_changed<log::Statistics>(good, log::Opcode::statistics, change));
  };
  EXPECT_EQ(statistics([](log::Statistics& s) { ++s.message_end_time; }),
            Kinds{"error statistics"});
  EXPECT_EQ(statistics([](log::Statistics& s) { ++s.channel_message_counts[1]; }),
            Kinds{"error statistics"});
}

TEST(Check, DamageCutsAndCounts) {
  std::string bytes = log_bytes(sample());
  EXPECT_EQ(kinds(log_bytes(sample(), {.close = false})), Kinds{"warning not-closed"});
  EXPECT_TRUE(kinds(bytes.substr(0, bytes.size() / 2)).contains("error damage"));
  bytes[300] = static_cast<char>(bytes[300] ^ 1);
  const CheckedLog damaged = check(bytes);
  EXPECT_EQ(damaged.findings.front().kind, "damage");
  EXPECT_EQ(kinds("what is this"), Kinds{"error damage"});
  EXPECT_EQ(kinds(""), Kinds{"error damage"});

  const auto counts = [](const std::string& text, std::vector<log::Metadata> more = {}) {
    more.push_back({kCountsName, {{"a/out (a)", text}}});
    return kinds(log_bytes(sample(), {.metadata = more}));
  };
  EXPECT_EQ(counts("received=40 lost=0"), Kinds{});
  EXPECT_EQ(counts("received=40 lost=2"), Kinds{"warning lost"});
  EXPECT_EQ(counts("received=41 lost=0"), Kinds{"error counts"});
  EXPECT_EQ(counts("received=41 lost=0", {{kRecoveredName, {}}}), Kinds{"warning counts"});
}

TEST(Check, PartsFollowEachOther) {
  const auto all = sample();
  const std::string first = log_bytes({all.begin(), all.begin() + 20}),
                    second = log_bytes({all.begin() + 20, all.end()},
                                       {.metadata = {{"mimesis.split", {{"previous", "a.mcap"}}}}});
  const auto check_both = [](std::string name_a, const std::string& a, std::string name_b,
                             const std::string& b) {
    Sequences sequences;
    std::vector<CheckedLog> logs;
    logs.push_back(check_log(name_a, log::MemorySource(a), sequences));
    logs.push_back(check_log(name_b, log::MemorySource(b), sequences));
    check_parts(logs);
    return kinds(logs[1]);
  };
  EXPECT_EQ(check_both("x/a.mcap", first, "x/b.mcap", second), Kinds{});
  EXPECT_EQ(check_both("x/c.mcap", first, "x/b.mcap", second), Kinds{"warning parts"});
  EXPECT_EQ(check_both("b.mcap", second, "a.mcap", first),
            (Kinds{"warning parts", "warning seq-back"}));
}

}  // namespace
}  // namespace mimesis::tool
