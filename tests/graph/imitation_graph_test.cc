// The whole chain of launch/imitation.yaml: the world's verdict agrees with the teacher's
// demonstration.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "proto/planner.pb.h"
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
  const char* arg;                      ///< demonstration, or scenario
  const char *grip, *transport, *goal;  ///< decision that the robot shall make
};

class Imitation : public ::testing::TestWithParam<Case> {};

TEST_P(Imitation, PlacesTheObjectWhereTheTeacherDid) {
  Scenario run("imitation", {"--arg", GetParam().arg});
  EXPECT_EQ(run.wait(), 0);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["grip"], GetParam().grip);
  EXPECT_EQ(result["transport"], GetParam().transport);
  EXPECT_EQ(result["goal"], GetParam().goal);
  EXPECT_EQ(result["placed"], true);
  EXPECT_EQ(result["collisions"], 0);
  EXPECT_LT(result["placement_error_mm"], 20.0);
  EXPECT_GT(result["can_frames"], 1000);
}

INSTANTIATE_TEST_SUITE_P(
    Teachers, Imitation,
    ::testing::Values(Case{"teacher=precision,above,high", "precision", "above", "high"},
                      Case{"teacher=full,below,low", "full", "below", "low"},
                      // The goal overrides the means: the bridge stands only on the robot's
                      // table [M18 fig. 2.21].
                      Case{"teacher=full,above,high", "precision", "above", "high"},
                      // The same, but means that the planner can do are copied: with a full
                      // grip only below [M18 fig. 2.22].
                      Case{"dialogue=true", "full", "below", "high"},
                      Case{"infer=true", "full", "below", "low"},
                      Case{"colour=true", "precision", "above", "high"}),
    [](const auto& c) { return "case" + std::to_string(c.index); });

/// launch/robot.yaml is the same graph on two hosts.
TEST(ImitationGraph, LockstepRunsAreEqualEvenSideBySideAndAsThoseOfTheRobot) {
  Scenario a("imitation"), b("robot", {"--arg", "sim=true"});
  EXPECT_EQ(a.wait(), 0);
  EXPECT_EQ(b.wait(), 0);
  ASSERT_TRUE(a.result().is_object());
  EXPECT_EQ(without_times(a.result()), without_times(b.result()));
  for (const char* topic : {"camera/image", "vision/observation", "cognition/decision",
                            "planner/trajectory", "bridge/arm", "sim_drives/arm", "world/state"}) {
    const auto of_a = until_verdict(a, topic);
    EXPECT_GE(of_a.size(), 6u) << topic;
    EXPECT_TRUE(of_a == until_verdict(b, topic)) << topic << " differs";
  }
}

TEST(ImitationGraph, BlockedGoalIsAFailureWithAReason) {
  Scenario run("imitation", {"--set", "world.goal_blocked=high"});
  EXPECT_EQ(run.wait(), 1);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["placed"], false);
  EXPECT_FALSE(result["reason"].get<std::string>().empty());
}

/// No means reach the goal that was seen: the means decide, and their goal is free.
TEST(ImitationGraph, ABlockedGoalIsDecidedByTheMeans) {
  Scenario run("imitation",
               {"--arg", "teacher=full,below,high", "--set", "world.goal_blocked=high"});
  EXPECT_EQ(run.wait(), 0);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["grip"], "full");
  EXPECT_EQ(result["transport"], "below");
  EXPECT_EQ(result["goal"], "low");
  EXPECT_EQ(result["placed"], true);
}

TEST(ImitationGraph, ADecisionThatNeverFallsEndsTheRunWithItsReason) {
  Scenario run("imitation", {"--arg", "infer=true", "--arg", "practised=[]"});
  EXPECT_EQ(run.wait(), 1);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["reason"], "no decision: PFC has no peak");
  EXPECT_LT(result["graph_s"], 30.0);
}

TEST(ImitationGraph, LogDrivesVisionAndCognitionToTheSameDecision) {
  Scenario run("imitation");
  ASSERT_EQ(run.wait(), 0);
  Scenario replay("replay", {"--arg", "log=" + run.log()});
  EXPECT_EQ(replay.wait(), 0);
  const json expected = run.result(), found = replay.result();
  ASSERT_TRUE(found.is_object()) << replay.process().output();
  for (const char* key : {"grip", "transport", "goal"}) EXPECT_EQ(found[key], expected[key]) << key;
}

TEST(ImitationGraph, WrongSettingsAreRefusedBeforeAnythingStarts) {
  Scenario run("imitation", {"--set", "vision.rate_hertz=30"});
  EXPECT_EQ(run.wait(), 2);
  EXPECT_NE(run.process().errors().find("rate_hz"), std::string::npos) << "no suggestion";
}

}  // namespace
}  // namespace mimesis::testing
