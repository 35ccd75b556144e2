// launch/drawer.yaml: the biped walks to a drawer, opens it and takes its object, also if the
// drawer is moved meanwhile.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "proto/motion.pb.h"
#include "proto/walker.pb.h"
#include "tests/graph/scenario.h"

namespace mimesis::testing {
namespace {

using nlohmann::json;

template <class M>
M last(const Scenario& run, const std::string& topic) {
  M message;
  const auto all = run.messages(topic);
  if (!all.empty()) message.ParseFromString(all.back().payload);
  return message;
}

void expect_taken(const json& result) {
  ASSERT_TRUE(result.is_object());
  EXPECT_EQ(result["success"], true) << result["reason"];
  EXPECT_EQ(result["fell"], false);
  EXPECT_EQ(result["action"], "take");
  EXPECT_LE(result["step_error_max_mm"], 10.0);
  EXPECT_EQ(result["failed_solves"], 0);
}

void expect_feet_at(const v1::BodyTruth& truth, double x_m) {
  ASSERT_EQ(truth.feet_size(), 2);
  for (const v1::Footprint& foot : truth.feet()) {
    EXPECT_NEAR(foot.position_in_world_m().x_m(), x_m, 0.06);
    EXPECT_LT(std::abs(foot.position_in_world_m().y_m()), 0.15);
  }
}

TEST(DrawerGraph, TakesWhatIsInTheDrawer) {
  Scenario run("drawer");
  EXPECT_EQ(run.wait(), 0);
  const json result = run.result();
  expect_taken(result);
  EXPECT_GE(result["steps"], 6);
  const auto drawer = last<v1::DrawerState>(run, "sim_body/drawer");
  EXPECT_TRUE(drawer.taken());
  EXPECT_GT(drawer.opened_m(), 0.1);
  // stands before the drawer as planned, by what really happened
  const auto truth = last<v1::BodyTruth>(run, "sim_body/truth");
  expect_feet_at(truth, 1.7 - 0.5);
}

TEST(DrawerGraph, FollowsADrawerThatIsMovedWhileItComes) {
  Scenario run("drawer", {"--arg", "jump_by=0.05", "--arg", "jump_at=4.5"});
  EXPECT_EQ(run.wait(), 0);
  expect_taken(run.result());
  const auto truth = last<v1::BodyTruth>(run, "sim_body/truth");
  expect_feet_at(truth, 1.75 - 0.5);
}

}  // namespace
}  // namespace mimesis::testing
