// Walkers that meet between pillars: none stands there for ever.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "nodes/crowd/run/scenario_run.h"
#include "nodes/crowd/scenario_file/scenario_file.h"

namespace mimesis::crowd {
namespace {

std::string not_arrived(const Crowd& crowd) {
  std::string who;
  for (int row = 0; row < crowd.size(); ++row) {
    const Agent a = crowd.agent(row);
    if ((a.state.position_W_m - a.traits.goal_W_m).norm() < 0.5) continue;
    who += std::to_string(a.id) + " at " + std::to_string(a.state.position_W_m.x()) + ", " +
           std::to_string(a.state.position_W_m.y()) + "; ";
  }
  return who;
}

TEST(Pillars, AllArriveFromEverySeed) {
  for (int seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Scenario scenario =
        read_scenario(find_scenario("pillars"), {"seed=" + std::to_string(seed)});
    ScenarioRun run(scenario);
    while (run.time_s() < scenario.until_s) {
      run.step();
      ASSERT_EQ(run.crowd().contacts().overlapping, 0) << run.time_s();
    }
    EXPECT_EQ(not_arrived(run.crowd()), "");
  }
}

}  // namespace
}  // namespace mimesis::crowd
