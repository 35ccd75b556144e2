// recover: all readable data, and exactly the missing parts.
#include <random>
#include <set>

#include "common/log/summary.h"
#include "tools/mimesis/log/rewrite.h"
#include "tools/mimesis/log/test/tool_logs.h"

namespace mimesis::tool {
namespace {

using testlogs::log_bytes;
using testlogs::read_log;
using testlogs::Sent;

class Recover : public testlogs::ToolLogs {
 protected:
  /// 300 messages of two topics; b/out lacks the numbers 50 to 52, which were never recorded.
  std::vector<Sent> sample() {
    std::vector<Sent> all;
    for (std::uint32_t i = 0; i < 300; ++i) {
      const bool a = i % 2 == 0;
      const std::uint32_t seq = i / 2 + 1;
      all.push_back({a ? "a/out" : "b/out", a ? "a" : "b", a || seq < 50 ? seq : seq + 3,
                     1000 + 10 * i, std::to_string(i)});
    }
    return all;
  }
  /// Exit code.
  int run(const std::string& bytes) try {
    RewriteOptions options;
    options.inputs = {save("in.mcap", bytes)};
    options.output.path = path("out.mcap");
    options.output.force = true;
    return log_recover(options);
  } catch (const VerbEnd& end) {
    return end.exit_code;
  }
  Recovered report(const std::string& bytes) {
    const log::MemorySource source(bytes);
    NewLog out({.path = path("report.mcap"), .force = true}, std::vector<OpenLog>());
    return recover(source, *log::summarize(source), out);
  }
};

TEST_F(Recover, AWholeLogComesThroughWithItsGapsNamed) {
  const std::string bytes = log_bytes(
      sample(),
      {.chunk_size = 1000, .metadata = {{"mimesis.run", {{"k", "v"}}}}, .attachment = "x"});
  EXPECT_EQ(run(bytes), 0);
  EXPECT_EQ(read_log(path("out.mcap")), sample());
  const auto summary = open_log(path("out.mcap")).summary;
  EXPECT_EQ(summary.attachments.size(), 1u);
  EXPECT_EQ(summary.metadata.size(), 1u);
  const Recovered found = report(bytes);
  EXPECT_FALSE(found.lost);
  ASSERT_EQ(found.topics.at(2).missing.size(), 1u);
  const MissingRun& gap = found.topics.at(2).missing[0];
  EXPECT_EQ(gap.first_seq, 50u);
  EXPECT_EQ(gap.messages, 3u);
  EXPECT_FALSE(gap.damaged);
}

TEST_F(Recover, ADamagedChunkIsMissingByTopicNumberAndTime) {
  std::string bytes = log_bytes(sample(), {.chunk_size = 1000});
  const log::MemorySource source(bytes);
  const auto summary = log::summarize(source);
  const auto& chunk = summary->segments.at(3).index;
  bytes[chunk.chunk_start_offset + chunk.chunk_length - 3] ^= 1;
  const Recovered found = report(bytes);
  EXPECT_TRUE(found.lost);
  EXPECT_TRUE(found.complete);
  std::uint64_t missing = 0;
  for (const auto& [id, topic] : found.topics) {
    std::uint64_t damaged = 0;
    for (const MissingRun& gap : topic.missing) {
      if (!gap.damaged) continue;
      damaged += gap.messages;
      EXPECT_LT(gap.after_ns, chunk.message_start_time);
      EXPECT_GT(gap.before_ns, chunk.message_end_time);
    }
    EXPECT_EQ(damaged, *topic.expected - topic.messages);
    missing += damaged;
  }
  EXPECT_GT(missing, 0u);
  const std::string text = recovery_text("in.mcap", found);
  EXPECT_NE(text.find("a/out (a): missing seq "), std::string::npos) << text;
  EXPECT_NE(text.find("b/out (b): missing seq 50 to 52 (3), between"), std::string::npos) << text;
  EXPECT_EQ(run(bytes), 1);
  EXPECT_EQ(read_log(path("out.mcap")).size(), 300 - missing);
}

TEST_F(Recover, DefinitionsComeFromTheSummaryWhereTheDataLostThem) {
  std::string bytes = log_bytes(sample(), {.chunk_size = 1000});
  const log::MemorySource source(bytes);
  const auto summary = log::summarize(source);
  bytes[summary->segments.at(0).index.chunk_start_offset + 100] ^= 1;  // the first has them
  EXPECT_EQ(run(bytes), 1);
  const auto recovered = read_log(path("out.mcap"));
  EXPECT_GT(recovered.size(), 250u);
  EXPECT_EQ(recovered.back(), sample().back());
  // Without the summary the topics are unknown: the messages are kept under the number of their
  // channel.
  bytes.resize(bytes.size() - 20);
  const std::uint64_t end = summary->segments.back().index.chunk_start_offset;
  EXPECT_EQ(run(bytes.substr(0, end)), 1);
  const auto unnamed = open_log(path("out.mcap"));
  std::set<std::string> topics;
  for (const auto& [id, channel] : unnamed.summary.channels) topics.insert(channel.topic);
  EXPECT_TRUE(topics.contains("unknown/channel_1"));
  EXPECT_GT(unnamed.summary.statistics.message_count, 200u);
}

TEST_F(Recover, ALogThatWasNotClosedHasLostNothingThatWasInIt) {
  EXPECT_EQ(run(log_bytes(sample(), {.chunk_size = 1000, .close = false})), 0);
  EXPECT_EQ(read_log(path("out.mcap")), sample());
  EXPECT_EQ(run("no log"), 1);
  EXPECT_EQ(files(), (std::vector<std::string>{"in.mcap", "out.mcap"}));
}

TEST_F(Recover, WhateverHappensToAFileTheOutputIsWholeAndTrue) {
  const std::string good = log_bytes(sample(), {.chunk_size = 700, .attachment = "y"});
  std::set<std::string> texts;
  for (const Sent& m : sample()) texts.insert(m.text);
  std::mt19937 random(5);
  for (int i = 0; i < 60; ++i) {
    std::string bad = good;
    for (unsigned edits = 1 + random() % 4; edits > 0; --edits) {
      bad[9 + random() % (bad.size() - 9)] = static_cast<char>(random());
    }
    if (i % 3 == 0) bad.resize(100 + random() % (bad.size() - 100));
    const int code = run(bad);
    ASSERT_TRUE(code == 0 || code == 1);
    for (const Sent& m : read_log(path("out.mcap"))) ASSERT_TRUE(texts.contains(m.text));
  }
}

}  // namespace
}  // namespace mimesis::tool
