#include <gtest/gtest.h>

#include "tools/mimesis/log/replay_log.h"

namespace mimesis::tool {
namespace {

using Lines = std::vector<std::string>;

TEST(FormerNames, OfPortsAndParametersAreGivenTheirPresentOnes) {
  v1::NodeStart start;
  start.set_executable("/opt/mimesis/bin/mimesis_bridge");
  start.add_inputs()->set_port("command");
  start.add_outputs()->set_port("arm");
  start.mutable_outputs(0)->set_topic("bridge/arm");
  start.set_parameters("rate_hz: 200\narming: \"auto\"\naxes:\n  - arming: 1\n");
  EXPECT_EQ(rename_former(start), (Lines{"port arm is called joint_states now",
                                         "parameter arming is called enable now"}));
  EXPECT_EQ(start.inputs(0).port(), "command");
  EXPECT_EQ(start.outputs(0).port(), "joint_states");
  EXPECT_EQ(start.outputs(0).topic(), "bridge/arm") << "as it is in the log";
  EXPECT_EQ(start.parameters(), "rate_hz: 200\nenable: \"auto\"\naxes:\n  - arming: 1\n");
}

TEST(FormerNames, OfNestedParametersAndModelFilesToo) {
  v1::NodeStart start;
  start.set_executable("mimesis_vision");
  start.set_parameters(
      "doubt: 3\nstereo:\n  doubt: 4\ntable:\n  yaw_rad: 0\n  doubt: 1\nopen: false\n");
  EXPECT_EQ(rename_former(start),
            Lines{"parameter table.doubt is called table.inflation_sigma now"});
  EXPECT_EQ(
      start.parameters(),
      "doubt: 3\nstereo:\n  doubt: 4\ntable:\n  yaw_rad: 0\n  inflation_sigma: 1\nopen: false\n");

  start.set_executable("mimesis_planner");
  start.set_parameters("table: \"bridge_table.yaml\"\nabout: \"a bridge_table.yaml\"\n");
  EXPECT_EQ(rename_former(start), Lines{"models/bridge_table.yaml is called bar_table.yaml now"});
  EXPECT_EQ(start.parameters(), "table: \"bar_table.yaml\"\nabout: \"a bridge_table.yaml\"\n");
}

TEST(FormerNames, OfAParameterAndTheModelFileThatItNames) {
  v1::NodeStart start;
  start.set_executable("mimesis_cognition");
  start.set_parameters("architecture: \"bridge_ladder.yaml\"\n");
  EXPECT_EQ(rename_former(start).size(), 2u);
  EXPECT_EQ(start.parameters(), "network: \"bar_fields.yaml\"\n");
}

TEST(FormerNames, OfAnotherProgramStay) {
  v1::NodeStart start;
  start.set_executable("my_arm");
  start.add_inputs()->set_port("arm");
  start.set_parameters("arming: \"auto\"\n");
  EXPECT_EQ(rename_former(start), Lines{});
  EXPECT_EQ(start.inputs(0).port(), "arm");
  EXPECT_EQ(start.parameters(), "arming: \"auto\"\n");
}

TEST(FormerNames, OfInputsAndServicesInRecordedSteps) {
  v1::StepLog log;
  log.add_sources()->set_port("arm");
  v1::StepRecord& step = *log.add_steps();
  step.add_requests()->set_service("arm");
  step.add_requests()->set_service("reset");
  v1::StepLog other = log;
  rename_former("mimesis_bridge", log);
  EXPECT_EQ(log.sources(0).port(), "joint_states");
  EXPECT_EQ(log.steps(0).requests(0).service(), "enable");
  EXPECT_EQ(log.steps(0).requests(1).service(), "reset");
  rename_former("mimesis_camera", other);
  EXPECT_EQ(other.sources(0).port(), "joint_states");
  EXPECT_EQ(other.steps(0).requests(0).service(), "arm");
}

}  // namespace
}  // namespace mimesis::tool
