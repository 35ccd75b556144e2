// launch/crowd.yaml: every scenario as people start it; one, two and four coordinators; characters
// that die and lag.
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>

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

using Places = std::map<std::uint64_t, std::pair<double, double>>;

/// Places of all agents in the step of the outcome.
Places at_the_end(const Scenario& run) {
  Places places;
  const auto outcome = run.messages("crowd/outcome");
  if (outcome.size() != 1) return places;
  for (const auto& message : run.messages("crowd/states")) {
    v1::CrowdStates states;
    if (message.time_ns != outcome[0].time_ns || !states.ParseFromString(message.payload)) continue;
    for (int i = 0; i < states.id_size(); ++i) {
      places[states.id(i)] = {states.position_in_world_m(2 * i),
                              states.position_in_world_m(2 * i + 1)};
    }
  }
  return places;
}

std::uint64_t lost(const Scenario& run, const std::string& node) {
  std::uint64_t lost = 0;
  for (const auto& message : run.messages(node + "/health")) {
    v1::Health health;
    health.ParseFromString(message.payload);
    for (const v1::InputHealth& input : health.inputs()) lost += input.lost();
  }
  return lost;
}

TEST(CrowdGraph, TwoAndFourCoordinatorsMakeTheSameFormationAsOne) {
  const std::vector<std::string> options = {"--arg", "scenario=formation", "--arg", "until=30"};
  Scenario one("crowd", options);
  EXPECT_EQ(one.wait(), 0);
  const Places places = at_the_end(one);
  ASSERT_EQ(places.size(), 16u);
  for (const char* several : {"crowd_two", "crowd_four"}) {
    Scenario run(several, options);
    EXPECT_EQ(run.wait(), 0);
    const json result = run.result();
    ASSERT_TRUE(result.is_object()) << run.process().output();
    EXPECT_EQ(result["success"], true) << result["reason"];
    EXPECT_GE(result["handed_over"], 4) << "all walk over the cut";
    EXPECT_EQ(lost(run, "crowd"), 0u);
    const Places others = at_the_end(run);
    ASSERT_EQ(others.size(), 16u);
    double farthest_m = 0.0;
    for (const auto& [id, place] : places) {
      const auto& other = others.at(id);
      farthest_m =
          std::max(farthest_m, std::hypot(place.first - other.first, place.second - other.second));
    }
    std::cout << several << ": farthest from where one has it " << farthest_m << " m\n";
    EXPECT_LT(farthest_m, 1e-3);
  }
}

TEST(CrowdGraph, FourHostsAreSimulatedAsOne) {
  Scenario one("crowd_four", {"--arg", "scenario=formation", "--arg", "until=10"});
  EXPECT_TRUE(one.wait().has_value());
  Scenario run("crowd_four_hosts",
               {"--arg", "scenario=formation", "--arg", "until=10", "--arg", "sim=true"});
  EXPECT_TRUE(run.wait().has_value());
  const Places places = at_the_end(one);
  EXPECT_EQ(places.size(), 16u);
  EXPECT_EQ(at_the_end(run), places);
}

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

TEST(CrowdGraph, OneOfFourCoordinatorsIsKilledAndItsNeighbourGoesOnWithItsAgents) {
  Scenario run("crowd_four", {"--arg", "scenario=formation", "--arg", "whole=false"});
  runtime::Tap tap(
      run.graph().name(), [](const std::string& topic) { return topic == "crowd3/status"; },
      runtime::Policy::reliable);
  std::uint32_t had = 0;
  while (had == 0 && !run.process().wait(0ms)) {
    const auto item = tap.next(100ms);
    v1::CrowdStatus status;
    if (!item || !status.ParseFromString(item->message.payload) || !status.runs()) continue;
    had = status.own();
    const pid_t third = run.pid("crowd3");
    ASSERT_GT(third, 0);
    if (had > 0) kill(third, SIGKILL);
  }
  ASSERT_GT(had, 0u);
  EXPECT_EQ(run.wait(), 0);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["success"], true) << result["reason"];
  EXPECT_EQ(result["agents"], 16) << "nobody is lost";
  EXPECT_LE(result["place_error_mm"], 10.0);
  EXPECT_EQ(at_the_end(run).size(), 16u);
  const std::string why = voided(run);
  EXPECT_NE(why.find("coordinator 3 fell silent, 1 has its region"), std::string::npos) << why;
}

TEST(CrowdGraph, AScenarioThatTheoryRefusesStopsTheStart) {
  Scenario run("crowd", {"--set", "crowd.set=groups.0.rules.phase.gain_1_s=-1"});
  EXPECT_EQ(run.wait(), 2);
  EXPECT_NE(run.process().errors().find("groups.0.rules.phase.gain_1_s"), std::string::npos)
      << run.process().errors();
}

}  // namespace
}  // namespace mimesis::testing
