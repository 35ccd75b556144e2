// launch/drawer.yaml: the biped walks to a drawer that is moved meanwhile, opens it and takes its
// object.
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

TEST(DrawerGraph, FollowsADrawerThatIsMovedAndTakesWhatIsInIt) {
  Scenario run("drawer", {"--arg", "jump_by=0.05", "--arg", "jump_at=4.5"});
  EXPECT_EQ(run.wait(), 0);
  const json result = run.result();
  ASSERT_TRUE(result.is_object());
  EXPECT_EQ(result["success"], true) << result["reason"];
  EXPECT_EQ(result["fell"], false);
  EXPECT_EQ(result["action"], "take");
  EXPECT_LE(result["step_error_max_mm"], 10.0);
  EXPECT_EQ(result["failed_solves"], 0);
  EXPECT_GE(result["steps"], 6);
  const auto drawer = last<v1::DrawerState>(run, "sim_body/drawer");
  EXPECT_TRUE(drawer.taken());
  EXPECT_GT(drawer.opened_m(), 0.1);
  // stands before the drawer as planned, by what really happened
  const auto truth = last<v1::BodyTruth>(run, "sim_body/truth");
  ASSERT_EQ(truth.feet_size(), 2);
  for (const v1::Footprint& foot : truth.feet()) {
    EXPECT_NEAR(foot.position_in_world_m().x_m(), 1.75 - 0.5, 0.06);
    EXPECT_LT(std::abs(foot.position_in_world_m().y_m()), 0.15);
  }
}

}  // namespace
}  // namespace mimesis::testing
