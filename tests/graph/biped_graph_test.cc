// launch/biped.yaml: the biped stands up, walks to a goal, is pushed; its walker is killed.
#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>

#include "proto/bridge.pb.h"
#include "proto/walker.pb.h"
#include "tests/graph/scenario.h"

namespace mimesis::testing {
namespace {

using nlohmann::json;

template <class M>
std::vector<M> all(const Scenario& run, const std::string& topic) {
  std::vector<M> messages;
  for (const auto& logged : run.messages(topic))
    messages.emplace_back().ParseFromString(logged.payload);
  return messages;
}

std::vector<v1::WalkState> states(const Scenario& run) {
  std::vector<v1::WalkState> found;
  for (const auto& status : all<v1::WalkerStatus>(run, "walker/status")) {
    if (found.empty() || found.back() != status.state()) found.push_back(status.state());
  }
  return found;
}

void expect_within_the_goals(const json& result) {
  EXPECT_EQ(result["fell"], false);
  EXPECT_LE(result["step_error_max_mm"], 10.0);
  EXPECT_LE(result["ankle_pitch_peak_n_m"], 30.0);
  EXPECT_LE(result["normal_peak_n"], 800.0);
  EXPECT_EQ(result["failed_solves"], 0);
}

/// Links with each other, or with furniture.
void expect_no_contacts(const Scenario& run) {
  const auto truth = all<v1::BodyTruth>(run, "sim_body/truth");
  ASSERT_FALSE(truth.empty());
  EXPECT_EQ(truth.back().self_collisions().steps(), 0u)
      << truth.back().self_collisions().deepest_between();
  EXPECT_EQ(truth.back().furniture_collisions().steps(), 0u)
      << truth.back().furniture_collisions().deepest_between();
}

TEST(BipedGraph, WalksToAGoalAndStandsThere) {
  Scenario run("biped", {"--arg", "x=0.6", "--set", "sim_body.settle_s=3"});
  EXPECT_EQ(run.wait(), 0);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  expect_within_the_goals(result);
  expect_no_contacts(run);
  EXPECT_GE(result["steps"], 4);
  EXPECT_LT(result["goal_distance_mm"], 150.0);
  const std::vector<v1::WalkState> expected = {v1::WALK_STATE_WAITING,  v1::WALK_STATE_STANDING,
                                               v1::WALK_STATE_STARTING, v1::WALK_STATE_WALKING,
                                               v1::WALK_STATE_STOPPING, v1::WALK_STATE_STANDING};
  EXPECT_EQ(states(run), expected);
  // the walker's estimate agrees with the robot's place
  const auto truth = all<v1::BodyTruth>(run, "sim_body/truth");
  const auto believed = all<v1::WalkFeedback>(run, "walker/feedback");
  ASSERT_FALSE(truth.empty());
  ASSERT_FALSE(believed.empty());
  const auto& is = truth.back().position_pelvis_in_world_m();
  const auto& says = believed.back().position_pelvis_in_world_m();
  EXPECT_NEAR(is.x_m(), 0.6, 0.15);
  EXPECT_NEAR(is.x_m(), says.x_m(), 0.03);
  EXPECT_NEAR(is.y_m(), says.y_m(), 0.03);
}

TEST(BipedGraph, IsPushedFromTheSideAndWalksOn) {
  Scenario run("biped", {"--arg", "x=0.6", "--arg", "push_y=7", "--arg", "push_at=5"});
  EXPECT_EQ(run.wait(), 0);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["success"], true);
  EXPECT_EQ(result["fell"], false);
  expect_no_contacts(run);
}

/// Nodes stop in wall time, and a walker that hears no motion any more ends its steps.
std::vector<Scenario::Logged> until_the_outcome(const Scenario& run, const std::string& topic) {
  const auto outcome = run.messages("sim_body/outcome");
  auto messages = run.messages(topic);
  std::erase_if(messages, [&](const Scenario::Logged& m) {
    return outcome.empty() || m.time_ns > outcome.front().time_ns;
  });
  return messages;
}

/// launch/biped_two.yaml is the same graph on two hosts.
TEST(BipedGraph, LockstepRunsAreEqualAndAsThoseOfTwoPcs) {
  Scenario a("biped", {"--arg", "time_limit=4.5"}),
      b("biped_two", {"--arg", "time_limit=4.5", "--arg", "sim=true"});
  EXPECT_EQ(a.wait(), 1);  // not there in time
  EXPECT_EQ(b.wait(), 1);
  EXPECT_EQ(a.result()["reason"], "goal not reached in time");
  for (const char* topic : {"walker/command", "sim_body/truth", "synthesizer/motion"}) {
    const auto of_a = until_the_outcome(a, topic), of_b = until_the_outcome(b, topic);
    EXPECT_GE(of_a.size(), 800U) << topic;
    EXPECT_TRUE(of_a == of_b) << topic << " differs";
  }
}

/// Until the robot has taken `steps`.
bool wait_walking(Scenario& run, std::uint32_t steps) {
  runtime::Tap tap(
      run.graph().name(), [](const std::string& topic) { return topic == "walker/feedback"; },
      runtime::Policy::reliable);
  while (!run.process().wait(0ms)) {
    const auto item = tap.next(100ms);
    v1::WalkFeedback feedback;
    if (item && feedback.ParseFromString(item->message.payload) && feedback.steps() >= steps) {
      return true;
    }
  }
  return false;
}

// No node balances any more. The bridge keeps the joints powered at their posture: a robot on both
// feet stays standing, one on a single foot falls as one piece. Both end the run with a reason.
TEST(BipedGraph, TheBridgeHoldsARobotWhoseWalkerWasKilled) {
  Scenario run("biped", {"--arg", "x=3", "--arg", "whole=false", "--arg", "time_limit=14"});
  ASSERT_TRUE(wait_walking(run, 2)) << run.process().errors();
  const pid_t walker = run.pid("walker");
  ASSERT_GT(walker, 0);
  kill(walker, SIGKILL);
  EXPECT_EQ(run.wait(), 1);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["success"], false);
  EXPECT_NE(result["reason"], "");
  const auto status = all<v1::BridgeStatus>(run, "bridge/status");
  ASSERT_FALSE(status.empty());
  EXPECT_EQ(status.back().reason(), "no command for 0.1 s: holding");
  for (const v1::BridgeStatus& s : status) EXPECT_NE(s.state(), "fault") << s.reason();
  const auto joints = all<v1::JointState>(run, "bridge/joint_states");
  for (const auto drive : joints.back().drives()) {
    EXPECT_NE(drive, v1::DRIVE_STATE_SWITCH_ON_DISABLED) << "without power it would collapse";
  }
}

TEST(BipedGraph, ARobotThatIsNoBipedStopsTheStart) {
  Scenario run("biped", {"--set", "walker.robot=lwr4.yaml"});
  EXPECT_EQ(run.wait(), 2);
  EXPECT_NE(run.process().errors().find("lwr4.yaml"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::testing
