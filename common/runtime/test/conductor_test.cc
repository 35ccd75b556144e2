#include "common/runtime/conductor.h"

#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <optional>

namespace mimesis::runtime {
namespace {

using namespace std::chrono_literals;
constexpr Time kNoEnd = Time::max();

v1::LockstepJoin join(const std::string& name, std::uint64_t start_id, double rate_hz,
                      double offset_s = 0.0, std::vector<std::string> inputs = {}) {
  v1::LockstepJoin j;
  j.set_node(name);
  j.set_start_id(start_id);
  j.set_rate_hz(rate_hz);
  j.set_offset_s(offset_s);
  for (std::string& input : inputs) j.add_inputs(std::move(input));
  return j;
}

v1::StepReport published(std::uint64_t start_id, const std::string& topic,
                         const std::vector<std::uint64_t>& seqs, bool latched = false) {
  v1::StepReport report;
  for (const std::uint64_t seq : seqs) {
    v1::Publication& p = *report.add_published();
    p.set_topic(topic);
    p.set_start_id(start_id);
    p.set_seq(seq);
    p.set_latched(latched);
  }
  return report;
}

/// "1:5 2:6": start_id:seq of what a step sees.
std::string seen(const Conductor::Go& go) {
  std::string text;
  for (const auto& p : go.message.visible()) {
    text +=
        (text.empty() ? "" : " ") + std::to_string(p.start_id()) + ":" + std::to_string(p.seq());
  }
  return text;
}

TEST(Conductor, TimeWaitsForAllParticipants) {
  Conductor c({"a", "b"}, kNoEnd);
  EXPECT_TRUE(c.advance().empty());
  c.join(join("b", 2, 10.0));
  EXPECT_TRUE(c.advance().empty());
  c.join(join("a", 1, 10.0));
  EXPECT_EQ(c.advance().size(), 2U);
  EXPECT_EQ(c.time(), 0ns);
}

TEST(Conductor, AMemberMaySayWhenItIsDueNext) {
  Conductor c({"player", "node"}, kNoEnd);
  c.join(join("player", 1, 1000.0));
  c.join(join("node", 2, 100.0));
  // nodes that step now; the player then reports its next time
  const auto steps = [&](std::optional<Time> next) {
    std::string who;
    for (const Conductor::Go& go : c.advance()) {
      who += std::to_string(go.start_id);
      v1::StepReport report;
      if (go.start_id == 1 && next) report.set_next_ns(static_cast<std::uint64_t>(next->count()));
      c.report(go.start_id, report);
    }
    return who + "@" + std::to_string(c.time().count());
  };
  EXPECT_EQ(steps(10'000'001ns), "12@0");
  EXPECT_EQ(steps({}), "2@10000000");
  EXPECT_EQ(steps(5ns), "1@10000001");  // in the past: at once
  EXPECT_EQ(steps(20ms), "1@10000002");
  EXPECT_EQ(steps({}), "12@20000000");  // now at its rate again
  EXPECT_EQ(steps({}), "1@21000000");
}

TEST(Conductor, AdvancesToTheEarliestDueTimeAndNotBeforeAllHaveReported) {
  Conductor c({"slow", "fast"}, kNoEnd);
  c.join(join("fast", 1, 1000.0, 0.0005));
  c.join(join("slow", 2, 400.0));
  const std::vector<std::pair<Time, std::uint64_t>> expected{{0us, 2},    {500us, 1},  {1500us, 1},
                                                             {2500us, 1}, {2500us, 2}, {3500us, 1}};
  std::vector<std::pair<Time, std::uint64_t>> actual;
  while (actual.size() < expected.size()) {
    const auto gos = c.advance();
    ASSERT_FALSE(gos.empty());
    for (const auto& go : gos) actual.emplace_back(c.time(), go.start_id);
    EXPECT_TRUE(c.advance().empty()) << "a step is running";
    for (const auto& go : gos) c.report(go.start_id, {});
  }
  EXPECT_EQ(actual, expected);
}

TEST(Conductor, RatesThatDoNotDivideASecondDoNotDrift) {
  Conductor c({"a"}, kNoEnd);
  c.join(join("a", 1, 30.0));
  for (int k = 0; k <= 300; ++k) {
    ASSERT_EQ(c.advance().size(), 1U);
    if (k % 30 == 0) {
      EXPECT_EQ(c.time(), k / 30 * 1s);
    }
    c.report(1, {});
  }
}

TEST(Conductor, ShowsWhatWasPublishedBeforeInOneOrder) {
  Conductor c({"z", "m", "reader"}, kNoEnd);
  c.join(join("z", 1, 10.0));
  c.join(join("m", 2, 10.0));
  c.join(join("reader", 3, 5.0, 0.0, {"z/out", "m/out"}));
  EXPECT_EQ(c.advance().size(), 3U);
  c.report(1, published(1, "z/out", {1, 2}));  // the order of reports does not matter
  c.report(3, {});
  c.report(2, published(2, "m/out", {1}));
  EXPECT_EQ(c.advance().size(), 2U);  // 0.1 s: without the reader
  c.report(2, published(2, "m/out", {2}));
  c.report(1, published(1, "z/elsewhere", {1}));
  const auto gos = c.advance();  // 0.2 s
  ASSERT_EQ(gos.size(), 3U);
  EXPECT_EQ(seen(gos[2]), "2:1 1:1 1:2 2:2");
  EXPECT_EQ(seen(gos[0]), "");
  for (const auto& go : gos) c.report(go.start_id, {});
  c.advance();
  c.report(1, {});
  c.report(2, {});
  EXPECT_EQ(seen(c.advance()[2]), "") << "shown once";
}

TEST(Conductor, AReportOfNoStepIsIgnored) {
  Conductor c({"a", "b"}, kNoEnd);
  c.join(join("a", 1, 10.0));
  c.join(join("b", 2, 10.0, 0.0, {"a/out"}));
  c.advance();
  c.report(1, published(1, "a/out", {1}));
  c.report(1, published(1, "a/out", {2}));
  c.report(2, {});
  EXPECT_EQ(seen(c.advance()[1]), "1:1");
}

TEST(Conductor, NobodyWaitsForTheDead) {
  Conductor c({"a", "b"}, kNoEnd);
  c.join(join("a", 1, 10.0));
  c.join(join("b", 2, 10.0));
  EXPECT_EQ(c.advance().size(), 2U);
  c.report(1, {});
  EXPECT_TRUE(c.advance().empty());
  c.leave(2);
  const auto gos = c.advance();
  ASSERT_EQ(gos.size(), 1U);
  EXPECT_EQ(gos[0].start_id, 1U);
}

TEST(Conductor, ARestartedNodeJoinsAtTheNextDueTimeAndSeesWhatIsLatched) {
  Conductor c({"a", "b"}, kNoEnd);
  c.join(join("a", 1, 10.0));
  c.join(join("b", 2, 10.0, 0.0, {"a/map"}));
  const auto first = c.advance();
  const std::uint64_t generation = first[0].message.generation();
  c.report(1, published(1, "a/map", {1}, true));
  c.report(2, {});
  EXPECT_EQ(c.advance().size(), 2U);
  c.leave(2);
  c.join(join("b", 9, 10.0, 0.0, {"a/map"}));
  EXPECT_TRUE(c.advance().empty()) << "a is still stepping";
  c.report(1, {});
  const auto gos = c.advance();
  ASSERT_EQ(gos.size(), 2U);
  EXPECT_EQ(c.time(), 200ms);
  EXPECT_NE(gos[0].message.generation(), generation);
  EXPECT_EQ(gos[1].start_id, 9U);
  EXPECT_EQ(seen(gos[1]), "1:1");
}

TEST(Conductor, MessagesOfConstructorsAreSeenByTheFirstSteps) {
  Conductor c({"a", "b"}, kNoEnd);
  auto a = join("a", 1, 10.0);
  *a.mutable_published() = published(1, "a/map", {1}).published();
  c.join(join("b", 2, 10.0, 0.0, {"a/map"}));
  c.join(a);
  EXPECT_EQ(seen(c.advance()[1]), "1:1");
}

TEST(Conductor, RefusesWhatWouldStopTimeOrTakeAnothersPlace) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Conductor c({"a"}, kNoEnd);
  EXPECT_EQ(c.join(join("x", 9, kInfinity)), "its rate is inf Hz, expected 1e-06 to 100000");
  for (const double rate : {0.0, -1.0, 1e-300, 1e9, std::nan("")})
    EXPECT_NE(c.join(join("x", 9, rate)), "") << rate;
  for (const double offset : {-1.0, kInfinity, 1e12, std::nan("")})
    EXPECT_NE(c.join(join("x", 9, 10.0, offset)), "") << offset;
  auto late = join("x", 9, 10.0);
  late.set_resume_ns(~std::uint64_t{0});
  EXPECT_NE(c.join(late), "");
  auto foreign = join("x", 9, 10.0);
  *foreign.mutable_published() = published(1, "a/map", {1}).published();
  EXPECT_EQ(c.join(foreign), "it reports messages of another node");

  EXPECT_EQ(c.join(join("a", 1, 10.0)), "");
  for (int k = 0; k < 2; ++k) {  // before and after the first step
    EXPECT_NE(c.join(join("x", 1, 10.0)), "") << "start id of a";
    EXPECT_NE(c.join(join("a", 9, 10.0)), "") << "name of a";
    const auto gos = c.advance();
    ASSERT_EQ(gos.size(), 1U);
    EXPECT_EQ(gos[0].start_id, 1U);
    EXPECT_TRUE(c.awaits(1));
    EXPECT_EQ(c.report(1, published(2, "b/out", {1})), Conductor::Reported::foreign);
    EXPECT_EQ(c.report(1, published(1, "a/out", {1})), Conductor::Reported::done);
    EXPECT_FALSE(c.awaits(1));
  }
}

TEST(Conductor, NobodyStepsFasterThanTimeCanGoOn) {
  Conductor c({"node"}, kNoEnd);
  c.join(join("node", 1, 100.0));
  c.join(join("hasty", 2, 100.0));
  int steps = 0, named = 0;
  while (c.time() < 2s && steps < 150'000) {
    for (const Conductor::Go& go : c.advance()) {
      v1::StepReport report;  // patience before is no credit
      if (go.start_id == 2)
        report.set_next_ns(go.message.time_ns() + (c.time() < 1s ? 10'000'000 : 1));
      named += c.report(go.start_id, report) == Conductor::Reported::hurried ? 1 : 0;
      ++steps;
    }
  }
  EXPECT_GE(c.time(), 2s);
  EXPECT_EQ(named, 1);
}

TEST(Conductor, AStepFarAwayIsWithinBounds) {
  Conductor c({"far"}, kNoEnd);
  c.join(join("far", 1, 100.0));
  v1::StepReport report;
  report.set_next_ns(~std::uint64_t{0});
  for (const Time expected : {Time(0), Time(1'000'000'000s), Time(1'000'000'000s + 1ns)}) {
    EXPECT_EQ(c.advance().size(), 1U);
    EXPECT_EQ(c.time(), expected);
    c.report(1, report);
  }
}

TEST(Conductor, OnlyParticipantsSayWhereTimeBegins) {
  Conductor c({"a"}, kNoEnd);
  auto stranger = join("x", 9, 10.0), a = join("a", 1, 10.0);
  stranger.set_resume_ns(1'250'000'000);
  a.set_resume_ns(1'200'000'000);
  EXPECT_EQ(c.join(stranger),
            "it resumes at 1.25 s, but is no participant: time begins without it");
  EXPECT_EQ(c.join(a), "");
  EXPECT_EQ(c.advance().size(), 1U);
  EXPECT_EQ(c.time(), 1300ms);
  stranger.set_resume_ns(1'450'000'000);
  EXPECT_EQ(c.join(stranger), "") << "and then it may come, but decides nothing";
  for (const auto& [time, who] : {std::pair(1400ms, "1"), {1500ms, "19"}}) {
    c.report(1, {});
    std::string stepping;
    for (const auto& go : c.advance()) stepping += std::to_string(go.start_id);
    EXPECT_EQ(stepping, who);
    EXPECT_EQ(c.time(), time);
  }
}

TEST(Conductor, EndsAfterTheLastStep) {
  Conductor c({"a"}, 200ms);
  c.join(join("a", 1, 10.0));
  for (int i = 0; i < 3; ++i) {
    const auto gos = c.advance();
    ASSERT_EQ(gos.size(), 1U);
    EXPECT_FALSE(gos[0].message.ended());
    c.report(1, {});
  }
  const auto gos = c.advance();
  ASSERT_EQ(gos.size(), 1U);
  EXPECT_TRUE(gos[0].message.ended());
  EXPECT_TRUE(c.ended());
  EXPECT_EQ(c.time(), 200ms);
}

TEST(Conductor, ARestartedConductorGoesOnWhereTheNodesAre) {
  Conductor c({"a", "b"}, kNoEnd);
  auto a = join("a", 1, 10.0);
  a.set_resume_ns(static_cast<std::uint64_t>(Time(1200ms).count()));
  c.join(a);
  c.join(join("b", 2, 20.0));
  const auto gos = c.advance();
  ASSERT_EQ(gos.size(), 1U);
  EXPECT_EQ(gos[0].start_id, 2U);
  EXPECT_EQ(c.time(), 1250ms);

  Conductor by_hand({}, kNoEnd);  // without participants whoever comes first
  EXPECT_EQ(by_hand.join(a), "");
  by_hand.advance();
  EXPECT_EQ(by_hand.time(), 1300ms);
}

}  // namespace
}  // namespace mimesis::runtime
