#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "experiments/walk/drawer/drawer_trial.h"
#include "experiments/walk/drawer/test/setting.h"

namespace mimesis::walk {
namespace {

DrawerResult result_of(const std::string& name) {
  DrawerResult r;
  r.walk.name = name;
  return r;
}

std::vector<DrawerTrialSpec> trials_of(std::uint64_t seed) {
  SuiteOptions options;
  options.seed = seed;
  options.delay_ticks = 2;
  return drawers30(setting().robot, setting().actions, options);
}

TEST(DrawerSuite, HasThirtyTasksOverTheWholeRange) {
  const auto trials = trials_of(3);
  ASSERT_EQ(trials.size(), 30U);
  std::set<std::string> names;
  int jumps = 0, nearer = 0, aside = 0;
  for (const DrawerTrialSpec& t : trials) {
    names.insert(t.name);
    EXPECT_GE(t.front_m, 1.2);
    EXPECT_LE(t.front_m, 2.8);
    EXPECT_GE(t.object_depth_m, 0.124);
    EXPECT_LE(t.object_depth_m, 0.273);
    EXPECT_LT(std::abs(t.left_m), 0.061 * t.front_m);
    EXPECT_EQ(t.delay_ticks, 2);
    aside += std::abs(t.left_m) > 0.02;
    for (const hw::sim::DrawerJump& jump : t.jumps) {
      ++jumps;
      nearer += jump.by_m < 0.0;
      EXPECT_LE(std::abs(jump.by_m), 0.10);
      EXPECT_GT(jump.at_s, t.stand_s - 1e-9);
      EXPECT_LT(jump.at_s, t.time_limit_s);
    }
  }
  EXPECT_EQ(names.size(), 30U);
  EXPECT_EQ(jumps, 20);
  EXPECT_GT(nearer, 3);
  EXPECT_LT(nearer, 17);
  EXPECT_GT(aside, 10);
}

TEST(DrawerSuite, IsDrawnFromItsSeed) {
  const auto names = [](std::uint64_t seed) {
    std::vector<std::string> out;
    for (const DrawerTrialSpec& t : trials_of(seed)) out.push_back(t.name);
    return out;
  };
  EXPECT_EQ(names(1), names(1));
  EXPECT_NE(names(1), names(2));
}

TEST(DrawerSuite, EveryEndIsAccountedFor) {
  std::vector<DrawerResult> results{result_of("good"), result_of("refused"), result_of("fell"),
                                    result_of("silent")};
  results[0].taken = true;
  results[0].reach_error_m = 0.004;
  results[0].lengths = {{synthesizer::kNormalStep, 0.50, 0.506}};
  results[1].refused = "that is too near";
  results[2].walk.figures.fell = true;
  results[2].walk.figures.how = "it lies";
  results[2].taken = true;  // the robot fell with the object
  results[2].lengths = {{synthesizer::kNormalStep, 0.50, 0.10}};
  EXPECT_EQ(end_of(results[0]), DrawerEnd::taken);
  EXPECT_EQ(end_of(results[1]), DrawerEnd::refused);
  EXPECT_EQ(end_of(results[2]), DrawerEnd::fell);
  EXPECT_EQ(end_of(results[3]), DrawerEnd::silent);
  const auto summary = summary_json(results);
  EXPECT_EQ(summary["taken"], 1);
  EXPECT_EQ(summary["falls"], 1);
  EXPECT_EQ(summary["silent"], 1);
  ASSERT_EQ(summary["not_taken"].size(), 3U);
  EXPECT_EQ(summary["not_taken"][0]["reason"], "that is too near");
  EXPECT_NE(summary["not_taken"][1]["reason"].get<std::string>().find("it lies"),
            std::string::npos);
  EXPECT_EQ(summary["not_taken"][2]["end"], "silent");
  EXPECT_DOUBLE_EQ(summary["object_error_max_m"], 0.004);
  EXPECT_NEAR(summary["length_error_max_m"].get<double>(), 0.006, 1e-12);  // not the fallen one's
  EXPECT_EQ(to_json(results[1])["end"], "refused");
  std::ostringstream table;
  print_table(results, table, false);
  EXPECT_NE(table.str().find("that is too near"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::walk
