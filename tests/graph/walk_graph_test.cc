// launch/walk.yaml: the figure with the model of the repository gets where it is sent.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "proto/motion.pb.h"
#include "tests/graph/scenario.h"

namespace mimesis::testing {
namespace {

using nlohmann::json;

v1::Motion last_motion(const Scenario& run) {
  v1::Motion motion;
  const auto all = run.messages("synthesizer/motion");
  if (!all.empty()) motion.ParseFromString(all.back().payload);
  return motion;
}

class Walk : public ::testing::TestWithParam<const char*> {};

TEST_P(Walk, ArrivesInTheStyle) {
  Scenario run("walk",
               {"--arg", std::string("style=") + GetParam(), "--arg", "x=3", "--arg", "y=-2"});
  EXPECT_EQ(run.wait(), 0);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["reached"], true);
  EXPECT_EQ(result["style"], GetParam());
  EXPECT_EQ(result["action"], "stand");
  EXPECT_LT(result["distance_mm"], 300.0);
  const v1::Motion motion = last_motion(run);
  EXPECT_NEAR(motion.position_pelvis_in_world_m().x_m(), 3.0, 0.3);
  EXPECT_NEAR(motion.position_pelvis_in_world_m().y_m(), -2.0, 0.3);
  EXPECT_GT(motion.position_pelvis_in_world_m().z_m(), 0.7);  // upright
}

INSTANTIATE_TEST_SUITE_P(Styles, Walk, ::testing::Values("slow", "brisk"),
                         [](const auto& c) { return std::string(c.param); });

TEST(WalkGraph, TakesWhatIsInADrawer) {
  Scenario run(
      "walk", {"--arg", "kind=drawer", "--arg", "drawer=true", "--arg", "x=3.5", "--arg", "y=0.5"});
  EXPECT_EQ(run.wait(), 0);
  const json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["action"], "take");
  EXPECT_NEAR(result["distance_mm"], 600.0, 130.0);
}

TEST(WalkGraph, AStyleThatTheModelHasNotStopsTheStart) {
  Scenario run("walk", {"--arg", "style=happy"});
  EXPECT_EQ(run.wait(), 2);
  EXPECT_NE(
      run.process().errors().find("'happy' is none of the model's: walk, slow, stride, brisk"),
      std::string::npos);
}

}  // namespace
}  // namespace mimesis::testing
