#include "nodes/planner/test/problemset/problemset.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "nodes/planner/path_search.h"
#include "nodes/planner/roadmap.h"

namespace mimesis::planner {
namespace {

struct Score {
  int asked = 0, solved = 0, blocked = 0, tasks = 0, tasks_solved = 0;
  std::vector<double> blocked_ms;
};

double quantile(std::vector<double> values, double p) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(p * static_cast<double>(values.size() - 1))];
}

/// Plans the queries that `wanted` picks. Every path returned is checked again.
template <class Wanted>
Score plan_scene(const kin::ArmModel& arm, const ProblemScene& scene, const Wanted& wanted) {
  using Clock = std::chrono::steady_clock;
  const auto ms_since = [](Clock::time_point t) {
    return std::chrono::duration<double, std::milli>(Clock::now() - t).count();
  };
  CollisionChecker checker(arm, scene.obstacles, 0.001);
  const auto begin = Clock::now();
  const Roadmap roadmap = build_roadmap(checker, Eigen::MatrixXd(arm.dof(), 0), {});
  const double build_ms = ms_since(begin);
  Score score;
  for (std::size_t i = 0; i < scene.queries.size(); ++i) {
    const Query& query = scene.queries[i];
    if (!wanted(query, i)) continue;
    const bool task = query.kind.starts_with("task");
    ++score.asked;
    score.tasks += task;
    const auto start = Clock::now();
    const auto found = find_path(roadmap, checker, query.start, query.goals, {}, {});
    const double ms = ms_since(start);
    if (!found) {
      std::printf("  %s query %zu (%s) after %.0f ms: %s\n", scene.name.c_str(), i,
                  query.kind.c_str(), ms, found.error().reason.c_str());
      continue;
    }
    ++score.solved;
    score.tasks_solved += task;
    if (found->waves > 0) {
      ++score.blocked;
      score.blocked_ms.push_back(ms);
    }
    CollisionChecker judge(arm, scene.obstacles, 0.0009);
    for (std::size_t k = 1; k < found->waypoints.size(); ++k) {
      EXPECT_TRUE(judge.certify(found->waypoints[k - 1], found->waypoints[k])) << scene.name << i;
    }
    EXPECT_EQ(found->waypoints.front(), query.start);
    EXPECT_EQ(found->waypoints.back(), query.goals[static_cast<std::size_t>(found->goal)]);
  }
  std::printf(
      "%-12s roadmap %5ld nodes %4.0f ms, refined %zu x (%.0f %% -> %.1f %%); solved %d of %d, "
      "blocked %d: "
      "median %.1f ms, p95 %.1f ms\n",
      scene.name.c_str(), static_cast<long>(roadmap.nodes.cols()), build_ms,
      roadmap.inhibited_share.size() - 1, 100 * roadmap.inhibited_share.front(),
      100 * roadmap.inhibited_share.back(), score.solved, score.asked, score.blocked,
      quantile(score.blocked_ms, 0.5), quantile(score.blocked_ms, 0.95));
  return score;
}

/// Task queries, and every second of the others: how many of those asked are solved. The rest stay
/// under the effort limit and are printed with their reason.
void plan_robot(const std::string& robot, double least_share) {
  const auto set = load_problem_set(robot);
  if (!set) GTEST_SKIP() << "no ../shared/data/planner";
  int asked = 0, solved = 0;
  for (const auto& scene : set->scenes) {
    const Score score = plan_scene(set->arm, scene, [](const Query& query, std::size_t i) {
      return query.kind.starts_with("task") || i % 2 == 0;
    });
    EXPECT_EQ(score.tasks_solved, score.tasks) << scene.name;
    asked += score.asked;
    solved += score.solved;
  }
  std::printf("%s: solved %d of %d\n", robot.c_str(), solved, asked);
  EXPECT_GE(solved, least_share * asked);
}

TEST(ProblemSet, Lwr) { plan_robot("lwr4p", 0.95); }

TEST(ProblemSet, Planar) { plan_robot("planar2", 1.0); }

}  // namespace
}  // namespace mimesis::planner
