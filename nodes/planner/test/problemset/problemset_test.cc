#include "nodes/planner/test/problemset/problemset.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "nodes/planner/path_search.h"

namespace mimesis::planner {
namespace {

constexpr double kPathMargin = 0.001;

/// Every path of the set is found without a roadmap, is certified, and is the same when asked
/// again.
void plan_robot(const std::string& robot, int queries) {
  const auto set = load_problem_set(robot);
  if (!set) GTEST_SKIP() << "not here: no ../shared/data/planner";
  int asked = 0, solved = 0, blocked = 0;
  long branches = 0;
  for (const auto& scene : set->scenes) {
    for (const Query& query : scene.queries) {
      SCOPED_TRACE(scene.name + " query " + std::to_string(asked++));
      CollisionChecker checker(set->arm, scene.obstacles, kPathMargin);
      const auto found = find_path({}, checker, query.start, query.goals, {}, {.shortcuts = 20});
      EXPECT_TRUE(found) << found.error().reason;
      if (!found) continue;
      ++solved;
      blocked += found->by == FoundBy::trees;
      branches += checker.postures_checked();
      EXPECT_EQ(found->waypoints.front(), query.start);
      EXPECT_EQ(found->waypoints.back(), query.goals[static_cast<std::size_t>(found->goal)]);
      CollisionChecker judge(set->arm, scene.obstacles, 0.9 * kPathMargin);
      for (std::size_t k = 1; k < found->waypoints.size(); ++k) {
        EXPECT_TRUE(judge.certify(found->waypoints[k - 1], found->waypoints[k]));
      }
      if (asked % 10 != 0) continue;
      const auto again = find_path({}, checker, query.start, query.goals, {}, {.shortcuts = 20});
      ASSERT_TRUE(again);
      EXPECT_EQ(again->waypoints, found->waypoints);
    }
  }
  std::printf("%s: solved %d of %d, %d of them not straight; %.0f postures a query\n",
              robot.c_str(), solved, asked, blocked, static_cast<double>(branches) / asked);
  EXPECT_EQ(solved, queries);
  EXPECT_GT(blocked, queries / 4);
}

TEST(ProblemSet, Lwr) { plan_robot("lwr4p", 256); }

TEST(ProblemSet, Rx90) { plan_robot("rx90", 255); }

TEST(ProblemSet, Planar) { plan_robot("planar2", 51); }

}  // namespace
}  // namespace mimesis::planner
