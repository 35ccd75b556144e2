// The whole chain of launch/imitation.yaml: the world's verdict agrees with the teacher's
// demonstration.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "tests/graph/scenario.h"

namespace mimesis::testing {
namespace {

using nlohmann::json;

json without_times(json result) {
  for (const char* key : {"wall_s", "log"}) result.erase(key);
  return result;
}

/// Messages on `topic` until the verdict; after it the launcher stops the nodes in wall time.
std::vector<Scenario::Logged> until_verdict(const Scenario& run, const std::string& topic) {
  const auto verdicts = run.messages("world/outcome");
  if (verdicts.size() != 1) return {};
  auto found = run.messages(topic);
  std::erase_if(found, [&](const auto& message) { return message.time_ns > verdicts[0].time_ns; });
  return found;
}

struct Case {
  const char* symbols;                  ///< what vision tells of the demonstration
  std::vector<std::string> options;     ///< scenario
  const char *grip, *transport, *goal;  ///< decision that the robot shall make
};

void expect_placed(const json& result, const char* grip, const char* transport, const char* goal) {
  ASSERT_TRUE(result.is_object());
  EXPECT_EQ(result["grip"], grip);
  EXPECT_EQ(result["transport"], transport);
  EXPECT_EQ(result["goal"], goal);
  EXPECT_EQ(result["placed"], true);
  EXPECT_EQ(result["collisions"], 0);
  EXPECT_LT(result["placement_error_mm"], 20.0);
  EXPECT_GT(result["can_frames"], 1000);
}

class Imitation : public ::testing::TestWithParam<Case> {};

TEST_P(Imitation, PlacesTheObjectWhereTheTeacherDid) {
  Scenario run("imitation", played(GetParam().symbols, GetParam().options));
  EXPECT_EQ(run.wait(), 0);
  expect_placed(run.result(), GetParam().grip, GetParam().transport, GetParam().goal);
}

INSTANTIATE_TEST_SUITE_P(
    Teachers, Imitation,
    ::testing::Values(
        // The goal overrides the means: only the robot's obstacle has a bar [M18 fig. 2.21].
        Case{"full_above_high", {"--arg", "goal_first=true"}, "precision", "above", "high"},
        // The same, but means that the planner can do are copied: with a full grip only below
        // [M18 fig. 2.22].
        Case{"full_above_high", {"--arg", "dialogue=true"}, "full", "below", "high"},
        Case{"full", {"--arg", "infer=true"}, "full", "below", "low"},
        Case{"full", {"--arg", "colour=true"}, "precision", "above", "high"}),
    [](const auto& c) { return "case" + std::to_string(c.index); });

/// launch/replay.yaml plays the log to vision and cognition.
TEST(ImitationGraph, DISABLED_SlowSeesAFullGripBelowTheBarAndAgainInTheLog) {
  Scenario run("imitation", {"--arg", "teacher=full,below,low"});
  EXPECT_EQ(run.wait(), 0);
  const json seen = run.result();
  expect_placed(seen, "full", "below", "low");
  Scenario replay("replay", {"--arg", "log=" + run.log()});
  EXPECT_EQ(replay.wait(), 0);
  const json again = replay.result();
  ASSERT_TRUE(again.is_object()) << replay.process().output();
  for (const char* key : {"grip", "transport", "goal"}) EXPECT_EQ(again[key], seen[key]) << key;
}

/// README.md shows the result of this run; tools/docs --demo writes it.
void expect_as_in_readme(const json& result) {
  std::ifstream file(MIMESIS_SOURCE_DIR "/README.md");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::size_t begin = text.find("\n{", text.find("$ tools/demo"));
  ASSERT_NE(begin, std::string::npos);
  const json shown = json::parse(text.substr(begin, text.find("}\n", begin) + 1 - begin));
  for (const auto& [key, value] : shown.items()) {
    if (key == "wall_s" || key == "log") continue;
    ASSERT_TRUE(result.contains(key)) << key;
    if (value.is_number()) {  // the last bits are those of the machine
      EXPECT_NEAR(result[key].get<double>(), value.get<double>(), 0.02 * value.get<double>() + 0.1)
          << key << ": README.md is old, run tools/docs --demo";
    } else {
      EXPECT_EQ(result[key], value) << key << ": README.md is old, run tools/docs --demo";
    }
  }
}

/// launch/robot.yaml is the same graph on two hosts; what it sees is what vision told before
/// (docs/site/pages_test.py runs the demo, with cameras).
TEST(ImitationGraph, RunsAreEqualEvenSideBySideAndAsThoseOfTheRobot) {
  Scenario a("imitation", played("precision_above_high")), b("robot", {"--arg", "sim=true"});
  EXPECT_EQ(a.wait(), 0);
  EXPECT_EQ(b.wait(), 0);
  const json expected = a.result();
  expect_placed(expected, "precision", "above", "high");
  expect_as_in_readme(expected);
  EXPECT_EQ(without_times(expected), without_times(b.result()));
  for (const char* topic : {"cognition/decision", "planner/trajectory", "bridge/joint_states",
                            "sim_drives/joint_states", "world/state"}) {
    const auto of_a = until_verdict(a, topic);
    EXPECT_GE(of_a.size(), 6u) << topic;
    EXPECT_TRUE(of_a == until_verdict(b, topic)) << topic << " differs";
  }
}

TEST(ImitationGraph, BlockedGoalIsAFailureWithAReason) {
  Scenario run("imitation",
               played("precision_above_high_blocked", {"--set", "world.goal_blocked=high"}));
  EXPECT_EQ(run.wait(), 1);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["placed"], false);
  EXPECT_FALSE(result["reason"].get<std::string>().empty());
}

/// No means reach the goal that was seen: the means decide, and their goal is free.
TEST(ImitationGraph, ABlockedGoalIsDecidedByTheMeans) {
  Scenario run("imitation",
               played("full_below_high_blocked", {"--set", "world.goal_blocked=high"}));
  EXPECT_EQ(run.wait(), 0);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["grip"], "full");
  EXPECT_EQ(result["transport"], "below");
  EXPECT_EQ(result["goal"], "low");
  EXPECT_EQ(result["placed"], true);
}

TEST(ImitationGraph, ADecisionThatNeverFallsEndsTheRunWithItsReason) {
  Scenario run("imitation", played("full", {"--arg", "infer=true", "--arg", "practised=[]"}));
  EXPECT_EQ(run.wait(), 1);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["reason"], "no decision: PFC has no peak");
  EXPECT_LT(result["graph_s"], 30.0);
}

TEST(ImitationGraph, WrongSettingsAreRefusedBeforeAnythingStarts) {
  Scenario run("imitation", {"--set", "vision.rate_hertz=30"});
  EXPECT_EQ(run.wait(), 2);
  EXPECT_NE(run.process().errors().find("rate_hz"), std::string::npos) << "no suggestion";
}

}  // namespace
}  // namespace mimesis::testing
