// One crowd of one, two and four coordinators.
#include <gtest/gtest.h>

#include <cmath>

#include "nodes/crowd/test/coordinators.h"
#include "nodes/crowd/test/scenario_file.h"

namespace mimesis::crowd {
namespace {

using namespace testing;

/// Largest distance between agents that both have: an agent on the way between two coordinators is
/// in its handover.
double farthest(const Coordinators& a, const Coordinators& b) {
  const auto left = a.agents(), right = b.agents();
  double most = 0.0;
  for (const auto& [id, state] : left) {
    if (const auto other = right.find(id); other != right.end()) {
      most = std::max(most, std::hypot(state[0] - other->second[0], state[1] - other->second[1]));
    }
  }
  return most;
}

/// One alone begins to walk in its first step; several in their third, when all have heard that all
/// hear each other.
void same_run(const std::string& text, const std::vector<double>& x_m,
              const std::vector<double>& y_m, double until_s, double tolerance_m, int handovers) {
  const ScenarioFile file(text);
  const CrowdParams params = file.params();
  Coordinators alone(params, {}, {}), several(params, x_m, y_m);
  several.step();
  several.step();
  while (alone.now() < runtime::from_seconds(100.0 + until_s)) {
    alone.step();
    several.step();
    ASSERT_LT(farthest(alone, several), tolerance_m) << several.handovers() << " handovers";
  }
  EXPECT_GE(several.handovers(), handovers);
  EXPECT_EQ(alone.agents().size(), several.agents().size()) << "somebody got lost";
}

TEST(Regions, TwoCoordinatorsMakeTheSameFormation) {
  same_run(kFormation, {0.0}, {}, 30.0, 1e-9, 5);
}

TEST(Regions, FourCoordinatorsMakeTheSameFormation) {
  same_run(kFormation, {4.0}, {0.0}, 30.0, 1e-9, 5);
}

TEST(Regions, AlongAChainToo) { same_run(kChain, {0.0}, {0.0}, 30.0, 1e-9, 5); }

TEST(Regions, AndWithALeaderAndABeat) {
  same_run(kLeader, {0.0}, {0.0}, 20.0, 1e-9, 2);
  same_run(kBeat, {0.0}, {0.0}, 20.0, 1e-9, 2);
}

TEST(Regions, WaitForEachOther) {
  const ScenarioFile file(kFormation);
  Coordinators two(file.params(), {0.0}, {});
  two.connect(false);
  for (int i = 0; i < 100; ++i) two.step();
  EXPECT_FALSE(two[0].status.runs());
  EXPECT_EQ(two[0].status.reason(), "waits for coordinator 2");
  EXPECT_EQ(two[1].status.reason(), "waits for coordinator 1");
  two.connect(true);
  for (int i = 0; i < 60; ++i) two.step();
  EXPECT_TRUE(two[0].status.runs());
  EXPECT_TRUE(two[1].status.runs());
}

TEST(Regions, StatesOfTheFutureWouldHideWhatComesAndAreIgnored) {
  const ScenarioFile file(kFormation);
  Coordinators two(file.params(), {0.0}, {});
  two.connect(false);
  two.step();
  v1::CrowdStates states;
  states.set_coordinator(2);
  two[0].bus.send("peers", states, two.now() + std::chrono::seconds(10));
  for (int i = 0; i < 100; ++i) two.step();
  EXPECT_EQ(two[0].status.reason(), "waits for coordinator 2");
}

/// Each of four, 6 s after the start: all have agents then.
TEST(Regions, WhoDiesIsSucceededByItsNeighbour) {
  const ScenarioFile file(kFormation);
  for (std::size_t dead = 0; dead < 4; ++dead) {
    Coordinators four(file.params(), {4.0}, {0.0});
    four.until(104.0);
    const std::size_t had = four[dead].agents.size();
    four.kill(dead);
    four.until(105.0);
    EXPECT_EQ(four.agents().size(), 16u) << "nobody is lost: " << had << " of number " << dead + 1;
    const std::size_t first = dead == 0 ? 1 : 0;
    if (had > 0) {
      EXPECT_NE(four[first].voided.find("fell silent"), std::string::npos) << four[first].voided;
    }
    four.until(145.0);
    EXPECT_EQ(four.agents().size(), 16u);
    EXPECT_TRUE(four[first].status.in_order());
    // After a restart it is empty, and gets the agents in its region.
    const std::size_t heirs = four.agents().size();
    four.start(dead, file.params());
    four.until(146.0);
    EXPECT_EQ(four.agents().size(), heirs);
    EXPECT_TRUE(four[dead].status.runs());
  }
}

TEST(Regions, WhoFallsSilentIsMissedAndNobodyIsSentThere) {
  const ScenarioFile file(kFormation);
  Coordinators two(file.params(), {12.0}, {});
  two.until(104.0);
  const std::size_t before = two[0].agents.size();
  ASSERT_EQ(before, 16u) << "nobody has come to the cut";
  two.connect(false);
  two.until(116.0);  // they walk far beyond it
  EXPECT_EQ(two[0].agents.size(), 16u);
  two.connect(true);
  two.until(118.0);
  EXPECT_EQ(two[0].agents.size(), 0u);
  EXPECT_EQ(two[1].agents.size(), 16u);
}

/// Neither died: only the half with number 1 goes on, with all agents; the other one's stand until
/// then. Nobody is moved twice.
TEST(Regions, OfTwoWhoDoNotHearEachOtherTheFirstGoesOn) {
  const ScenarioFile file(kFormation);
  for (const double cut : {1000.0, -1000.0}) {
    Coordinators two(file.params(), {cut}, {});
    const std::size_t mine = cut > 0.0 ? 0 : 1;
    two.until(104.0);
    ASSERT_EQ(two[mine].agents.size(), 16u);
    two.connect(false);
    while (two.now() < runtime::from_seconds(106.0)) {
      two.step();
      EXPECT_TRUE(two[0].agents.empty() || two[1].agents.empty()) << "moved by both";
    }
    EXPECT_EQ(two[0].agents.size(), 16u);
    EXPECT_EQ(two[1].agents.size(), 0u);
    two.connect(true);
    two.until(108.0);
    EXPECT_EQ(two[mine].agents.size(), 16u);
    EXPECT_EQ(two.agents().size(), 16u);
    EXPECT_EQ(two[0].status.given(), mine == 0 ? 0u : 16u) << "number 1 had them";
    EXPECT_EQ(two[1].status.given(), 0u);
  }
}

}  // namespace
}  // namespace mimesis::crowd
