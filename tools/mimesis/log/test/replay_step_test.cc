// All actions of a step are compared with the log.
#include "tools/mimesis/log/replay_step.h"

#include "tools/mimesis/log/replay_compare.h"
#include "tools/mimesis/log/replay_log.h"
#include "tools/mimesis/log/test/node_run_log.h"

namespace mimesis::tool {
namespace {

constexpr std::uint64_t kTime = 10'000'000;

v1::OutsideBytes outside(const std::string& name, const std::string& data, bool written = true) {
  v1::OutsideBytes bytes;
  bytes.set_name(name);
  bytes.set_data(data);
  bytes.set_written(written);
  return bytes;
}

/// A step that published n/out #1, wrote twice, read once and answered a request; and a replay of
/// it that did the same.
class Comparison : public ::testing::Test {
 protected:
  Comparison() {
    record_ = step_record(v1::STEP_KIND_STEP, kTime, {}, 1);
    *record_.add_outside() = outside("can", "first");
    *record_.add_outside() = outside("can", "what was read", false);
    *record_.add_outside() = outside("can", "second");
    v1::ServedRequest& served = *record_.add_requests();
    served.set_service("stop");
    served.set_response("stopped");

    v1::ReplayMessage& output = *outcome_.add_outputs();
    output.set_topic("n/out");
    output.set_seq(1);
    output.set_payload(NodeRunLog::payload(1));
    output.set_stamp_ns(kTime);
    *outcome_.add_written() = outside("can", "first");
    *outcome_.add_written() = outside("can", "second");
    *outcome_.add_served() = served;
  }

  std::vector<ReplayDifference> compare(double tolerance = 0.0) {
    NodeRunLog log;
    log.output(1, kTime).output(2, kTime);
    log.steps(kTime + 1, 0, {step_record(v1::STEP_KIND_CREATE, 0), record_});
    const NodeRun node_run = log.node_run();
    NodeRunReader reader(log.logs(), node_run);
    ReplayCompare messages(tolerance);
    StepComparison comparison(node_run, reader, messages);
    reader.next();
    const auto step = reader.next();
    auto found = comparison.compare(*step, outcome_);
    counts_ = comparison.counts();
    missing_ = comparison.missing();
    return found;
  }
  /// Text of the only difference.
  std::string what(double tolerance = 0.0) {
    const auto found = compare(tolerance);
    EXPECT_EQ(found.size(), 1U);
    if (found.empty()) return "";
    EXPECT_EQ(found.front().step, 1U);
    EXPECT_EQ(found.front().time_s, 0.01);
    fields_.clear();
    for (const FieldDifference& f : found.front().fields.fields) {
      fields_ += f.path + ": " + f.a + " | " + f.b + "\n";
    }
    EXPECT_EQ(found.front().fields.count, found.front().fields.fields.size());
    return found.front().what;
  }

  v1::StepRecord record_;
  v1::ReplayOutcome outcome_;
  ReplayCounts counts_;
  std::map<std::string, std::uint64_t> missing_;
  std::string fields_;
};

TEST_F(Comparison, TheSameIsEqualAndCounted) {
  EXPECT_TRUE(compare().empty());
  EXPECT_EQ(counts_.steps, 1U);
  EXPECT_EQ(counts_.outputs, 1U);
  EXPECT_EQ(counts_.writes, 2U);
  EXPECT_EQ(counts_.responses, 1U);
  EXPECT_EQ(counts_.bytes, NodeRunLog::payload(1).size());
  EXPECT_TRUE(missing_.empty());
}

TEST_F(Comparison, PayloadAndStampOfOutputs) {
  outcome_.mutable_outputs(0)->set_payload(NodeRunLog::payload(5));
  EXPECT_EQ(what(), "n/out #1 differs in 1 field");
  EXPECT_EQ(fields_, "seq: 1 | 5\n");
  outcome_.mutable_outputs(0)->set_stamp_ns(kTime + 1);
  EXPECT_EQ(what(1e9), "n/out #1 differs in 2 fields") << "a tolerance is not for integers";
  EXPECT_EQ(fields_, "(publish time) ns: 10000000 | 10000001\nseq: 1 | 5\n");
  outcome_.mutable_outputs(0)->set_payload(NodeRunLog::payload(1));
  EXPECT_EQ(what(), "n/out #1 differs in 1 field");
  EXPECT_EQ(fields_, "(publish time) ns: 10000000 | 10000001\n");
}

TEST_F(Comparison, TheNumberOfOutputs) {
  record_.set_published(2);
  EXPECT_EQ(what(),
            "the recorded step published 2 messages, the replayed one 1 (1 on n/out); n/out #2 is "
            "the first that was not published again");
  record_.set_published(0);
  EXPECT_EQ(what(), "the recorded step published 0 messages, the replayed one 1 (1 on n/out)");
  EXPECT_EQ(fields_, "(messages): 0 | 1\n");
}

TEST_F(Comparison, AnOutputThatTheLogDoesNotHoldIsCountedAsMissing) {
  outcome_.mutable_outputs(0)->set_topic("n/other");
  EXPECT_TRUE(compare().empty());
  EXPECT_EQ(counts_.outputs, 0U);
  EXPECT_EQ(missing_, (std::map<std::string, std::uint64_t>{{"n/other", 1}}));
}

TEST_F(Comparison, BytesAndNamesOfWrites) {
  outcome_.mutable_written(1)->set_data("sekond");
  EXPECT_EQ(what(1e9), "write 2 of the step, to 'can', differs") << "no tolerance for devices";
  EXPECT_EQ(fields_, "(written) can: 6 bytes, at 2: 63 6f 6e 64 | 6 bytes, at 2: 6b 6f 6e 64\n");
  outcome_.mutable_written(0)->set_name("modbus");
  EXPECT_EQ(what(), "write 1 of the step goes to 'modbus', the recorded one went to 'can'");
}

TEST_F(Comparison, TheNumberOfWrites) {
  outcome_.mutable_written()->RemoveLast();
  EXPECT_EQ(what(), "the recorded step wrote 2 packets to the outside, the replayed one 1");
  outcome_.clear_written();
  for (const char* data : {"first", "second", "third"}) {
    *outcome_.add_written() = outside("can", data);
  }
  EXPECT_EQ(what(), "the recorded step wrote 2 packets to the outside, the replayed one 3");
}

TEST_F(Comparison, AnswersOfServices) {
  outcome_.mutable_served(0)->set_response("stoppeD");
  EXPECT_EQ(what(), "the response of service 'stop' before the step differs");
  EXPECT_EQ(fields_, "(response): 7 bytes, at 6: 64 | 7 bytes, at 6: 44\n");
  outcome_.mutable_served(0)->set_response("stopped");
  outcome_.mutable_served(0)->set_failure("no");
  EXPECT_EQ(what(), "the response of service 'stop' before the step differs");
  EXPECT_EQ(fields_, "(failure):  | no\n");
}

TEST_F(Comparison, WhatTheNodeSaysOfAStepItCannotReplay) {
  outcome_.set_problem("read more than was recorded");
  EXPECT_EQ(what(), "read more than was recorded");
}

/// A log is data: it names nodes of Mimesis, which are looked for beside this program.
TEST(ReplayedProgram, IsNoneThatALogChooses) {
  NodeRun node_run;
  node_run.start.set_node("n");
  for (const char* name :
       {"", "/bin/sh", "./mimesis_vision", "../bin/mimesis_vision", "mimesis_a/../../../bin/sh",
        "sh", "mimesis", "mimesis_vision; reboot", "mimesis_$(reboot)", "mimesis_vision\n",
        "-mimesis_vision", "mimesis_../x", "~/mimesis_vision", "mimesis_\xff"}) {
    node_run.start.set_executable(name);
    try {
      ADD_FAILURE() << name << " runs " << program_of(node_run, "");
    } catch (const ConfigError& e) {
      EXPECT_NE(std::string(e.what()).find("the log names the program"), std::string::npos)
          << e.what();
    }
  }
  node_run.start.set_executable("mimesis_of_nobody");
  EXPECT_THROW(program_of(node_run, ""), ConfigError) << "not beside this program";
  EXPECT_EQ(program_of(node_run, "/bin/sh"), "/bin/sh") << "the user's choice";
  node_run.start.set_executable("sh");
  EXPECT_EQ(program_of(node_run, "/bin"), "/bin/sh") << "a name in the user's folder";
  node_run.start.set_executable("../bin/sh");
  EXPECT_THROW(program_of(node_run, "/bin"), ConfigError);
}

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
