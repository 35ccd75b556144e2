// launch/crowd_biped.yaml: a robot in a physics world walks in a crowd.
#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>

#include "proto/crowd.pb.h"
#include "proto/runtime.pb.h"
#include "proto/walker.pb.h"
#include "tests/graph/scenario.h"

namespace mimesis::testing {
namespace {

using nlohmann::json;

TEST(CrowdBiped, TakesItsPlaceInStep) {
  Scenario run("crowd_biped", {"--arg", "until=38"});
  EXPECT_EQ(run.wait(), 0);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["success"], true) << result["reason"];
  EXPECT_EQ(result["agents"], 5) << "four and the robot";
  EXPECT_LE(result["place_error_mm"], 20.0);
  EXPECT_EQ(result["collisions"], 0);
  EXPECT_GT(double(result["measured_rate_1_s"]), 0.0) << "not guaranteed: the robot follows late";
  EXPECT_GE(result["steps"], 40) << "of the robot";
  for (const auto& message : run.messages("sim_body/truth")) {
    v1::BodyTruth truth;
    ASSERT_TRUE(truth.ParseFromString(message.payload));
    ASSERT_FALSE(truth.fell()) << truth.how();
  }
}

TEST(Fleet, ABipedBasesAndFiguresJoinByName) {
  Scenario run("fleet", {"--arg", "until=16"});
  (void)run.wait();  // not in order yet
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["agents"], 18);
  EXPECT_EQ(result["collisions"], 0);
  EXPECT_LE(result["place_error_mm"], 700.0) << "of 1.8 m at the start";
}

TEST(CrowdBiped, ItsWalkerIsKilledAndTheOthersGoOn) {
  Scenario run("crowd_biped", {"--arg", "whole=false", "--arg", "until=8"});
  runtime::Tap tap(
      run.graph().name(), [](const std::string& topic) { return topic == "crowd/status"; },
      runtime::Policy::reliable);
  bool killed = false;
  while (!killed && !run.process().wait(0ms)) {
    const auto item = tap.next(100ms);
    v1::CrowdStatus status;
    if (!item || !status.ParseFromString(item->message.payload) || status.externals_size() == 0) {
      continue;
    }
    if (status.externals(0).trust() != v1::CROWD_TRUST_TRUSTED) continue;
    const pid_t walker = run.pid("walker");
    ASSERT_GT(walker, 0);
    kill(walker, SIGKILL);
    killed = true;
  }
  ASSERT_TRUE(killed) << run.process().errors();
  (void)run.wait();
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["agents"], 4) << "without the robot";
  EXPECT_EQ(result["collisions"], 0);
  std::string voided;
  for (const auto& message : run.messages("crowd/certificate")) {
    v1::CrowdCertificate certificate;
    certificate.ParseFromString(message.payload);
    voided += certificate.voided() + "\n";
  }
  EXPECT_NE(voided.find("'walker' its last state is"), std::string::npos) << voided;
}

}  // namespace
}  // namespace mimesis::testing
