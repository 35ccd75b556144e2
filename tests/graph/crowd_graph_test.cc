// launch/crowd.yaml: every scenario as people start it; characters of several hosts, that die and
// lag; a coordinator that dies.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "proto/crowd.pb.h"
#include "proto/runtime.pb.h"
#include "tests/graph/scenario.h"

namespace mimesis::testing {
namespace {

using nlohmann::json;

struct Case {
  const char* scenario;
  bool forms;
};

class Crowd : public ::testing::TestWithParam<Case> {};

TEST_P(Crowd, DoesWhatItsRulesAreFor) {
  Scenario run("crowd", {"--arg", std::string("scenario=") + GetParam().scenario});
  EXPECT_EQ(run.wait(), 0);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["success"], true) << result["reason"];
  EXPECT_GE(result["agents"], 9);
  EXPECT_GT(result["guaranteed_rate_1_s"], 0.0);
  EXPECT_GE(result["expected_rate_1_s"], result["guaranteed_rate_1_s"]);
  if (GetParam().forms) {
    EXPECT_GT(result["time_to_formation_s"], 0.0);
  }
  ASSERT_TRUE(result["measured_rate_1_s"].is_number());
  EXPECT_GE(result["measured_rate_1_s"].get<double>(),
            0.99 * result["guaranteed_rate_1_s"].get<double>());
  EXPECT_EQ(result["collisions"], 0);
  if (std::string_view(GetParam().scenario) == "dance") {  // they come in on the right foot
    EXPECT_GE(result["entrances"], 12);
    EXPECT_EQ(result["wrong_foot"], 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenarios, Crowd,
                         ::testing::Values(Case{"soldiers", true}, Case{"leader", true},
                                           Case{"formation", true}, Case{"crossing", false},
                                           Case{"pillars", false}, Case{"dance", false}),
                         [](const auto& c) { return std::string(c.param.scenario); });

TEST(CrowdGraph, FiguresOfTheSynthesizerTakeTheirPlaces) {
  Scenario run("crowd",
               {"--arg", "scenario=characters", "--arg", "characters=true", "--arg", "figures=3"});
  EXPECT_EQ(run.wait(), 0);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["success"], true) << result["reason"];
  EXPECT_EQ(result["agents"], 12);
  EXPECT_LE(result["place_error_mm"], 10.0);
  EXPECT_EQ(result["collisions"], 0);
  EXPECT_GT(double(result["measured_rate_1_s"]), 0.0) << "not guaranteed: figures follow late";
  EXPECT_LT(result["time_to_formation_s"], 25.0) << "what `crowd certify characters` says";
  EXPECT_GE(run.messages("crowd/command").size(), 1000u);
}

/// Waits until the crowd reports `wanted` for its first external agent; false: the run ended
/// before.
bool wait_trust(Scenario& run, runtime::Tap& tap, v1::CrowdTrust wanted) {
  while (!run.process().wait(0ms)) {
    const auto item = tap.next(100ms);
    v1::CrowdStatus status;
    if (item && status.ParseFromString(item->message.payload) && status.externals_size() > 0 &&
        status.externals(0).trust() == wanted) {
      return true;
    }
  }
  return false;
}

/// Reasons of the run's certificates that void the one before.
std::string voided(const Scenario& run) {
  std::string all;
  for (const auto& message : run.messages("crowd/certificate")) {
    v1::CrowdCertificate certificate;
    certificate.ParseFromString(message.payload);
    if (!certificate.voided().empty()) all += certificate.voided() + "\n";
  }
  return all;
}

TEST(CrowdGraph, TheSynthesizerLagsThenIsKilledAndTheCrowdGoesOn) {
  Scenario run("crowd", {"--arg", "scenario=characters", "--arg", "characters=true", "--arg",
                         "clock=wall", "--arg", "until=40"});
  runtime::Tap tap(
      run.graph().name(), [](const std::string& topic) { return topic == "crowd/status"; },
      runtime::Policy::reliable);
  ASSERT_TRUE(wait_trust(run, tap, v1::CROWD_TRUST_TRUSTED)) << run.process().errors();
  const pid_t synthesizer = run.pid("synthesizer");
  ASSERT_GT(synthesizer, 0);
  kill(synthesizer, SIGSTOP);
  EXPECT_TRUE(wait_trust(run, tap, v1::CROWD_TRUST_LAGGING));
  kill(synthesizer, SIGCONT);
  EXPECT_TRUE(wait_trust(run, tap, v1::CROWD_TRUST_TRUSTED));
  kill(synthesizer, SIGKILL);
  EXPECT_TRUE(wait_trust(run, tap, v1::CROWD_TRUST_ABSENT));
  EXPECT_EQ(run.wait(), 0) << "the nine others form their square";
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["success"], true) << result["reason"];
  EXPECT_EQ(result["agents"], 9);
  const std::string why = voided(run);
  EXPECT_NE(why.find("it came"), std::string::npos) << why;
  EXPECT_NE(why.find("its last state is"), std::string::npos) << why;
  EXPECT_NE(why.find("it is in time again"), std::string::npos) << why;
}

TEST(CrowdGraph, FiguresOfThreeHostsTakeTheirPlaces) {
  Scenario run("crowd_four_hosts", {"--arg", "sim=true"});
  EXPECT_EQ(run.wait(), 0);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["success"], true) << result["reason"];
  EXPECT_EQ(result["agents"], 15);
  EXPECT_LE(result["place_error_mm"], 10.0);
  EXPECT_EQ(result["collisions"], 0);
}

/// Figures stand without the coordinator; the new one takes them over where they are. Nobody is
/// there twice, and nobody is lost.
TEST(CrowdGraph, ACoordinatorThatDiesIsStartedAgainAndTakesTheFiguresOver) {
  Scenario run("crowd_four_hosts",
               {"--arg", "sim=true", "--arg", "clock=wall", "--arg", "until=15"});
  runtime::Tap tap(
      run.graph().name(), [](const std::string& topic) { return topic == "crowd/status"; },
      runtime::Policy::reliable);
  const auto all_trusted = [&] {
    while (!run.process().wait(0ms)) {
      const auto item = tap.next(100ms);
      v1::CrowdStatus status;
      if (!item || !status.ParseFromString(item->message.payload)) continue;
      const auto trusted = std::ranges::count(status.externals(), v1::CROWD_TRUST_TRUSTED,
                                              &v1::CrowdExternal::trust);
      if (trusted == 9) return true;
    }
    return false;
  };
  ASSERT_TRUE(all_trusted()) << run.process().errors();
  const pid_t first = run.pid("crowd");
  ASSERT_GT(first, 0);
  kill(first, SIGKILL);
  pid_t second = first;
  while (second == first || second <= 0) {
    ASSERT_FALSE(run.process().wait(50ms)) << run.process().errors();
    second = run.pid("crowd");
  }
  EXPECT_TRUE(all_trusted()) << run.process().errors();
  EXPECT_TRUE(run.wait()) << run.process().errors();  // a busy machine may be out of order
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["agents"], 15);
  for (const auto& message : run.messages("crowd/states")) {
    v1::CrowdStates states;
    ASSERT_TRUE(states.ParseFromString(message.payload));
    std::vector<std::uint64_t> ids(states.id().begin(), states.id().end());
    std::ranges::sort(ids);
    EXPECT_EQ(std::ranges::adjacent_find(ids), ids.end());
    EXPECT_LE(ids.size(), 15U);
  }
}

TEST(CrowdGraph, AScenarioThatTheoryRefusesStopsTheStart) {
  Scenario run("crowd", {"--set", "crowd.set=groups.0.rules.phase.gain_1_s=-1"});
  EXPECT_EQ(run.wait(), 2);
  EXPECT_NE(run.process().errors().find("groups.0.rules.phase.gain_1_s"), std::string::npos)
      << run.process().errors();
}

}  // namespace
}  // namespace mimesis::testing
