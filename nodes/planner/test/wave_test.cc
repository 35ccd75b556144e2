#include <gtest/gtest.h>

#include <cmath>
#include <queue>

#include "nodes/planner/path_search.h"
#include "nodes/planner/roadmap.h"

namespace mimesis::planner {
namespace {

constexpr double kWeight = 1e-7;  // weights are stored in single precision

void link(NeighbourLists& links, int a, int b, double length) {
  links[static_cast<std::size_t>(a)].push_back({b, length});
  links[static_cast<std::size_t>(b)].push_back({a, length});
}

/// Steps of a breadth-first search from `source`; -1: not reached.
std::vector<int> hops(const Linkage& links, const std::vector<char>& inhibited, int source) {
  std::vector<int> steps(links.size(), -1);
  std::queue<int> open;
  steps[static_cast<std::size_t>(source)] = 0;
  for (open.push(source); !open.empty(); open.pop()) {
    for (const Link& next : links[static_cast<std::size_t>(open.front())]) {
      const auto j = static_cast<std::size_t>(next.to);
      if (inhibited[j] || steps[j] >= 0) continue;
      steps[j] = steps[static_cast<std::size_t>(open.front())] + 1;
      open.push(next.to);
    }
  }
  return steps;
}

TEST(Wave, MultipliesWeightsAlongAChain) {  // v_i = exp(-distance to the goal)
  NeighbourLists links(4);
  link(links, 0, 1, 0.5);
  link(links, 1, 2, 0.25);
  link(links, 2, 3, 1.0);
  const std::vector<char> all_free(4, 0);
  const std::vector<int> goals{3};
  const Wave wave = expand_wave(links, all_free, {}, 0, goals);
  ASSERT_TRUE(wave.reached);
  EXPECT_NEAR(wave.v[0], std::exp(-1.75), kWeight);
  EXPECT_EQ(follow_wave(links, wave, 0), (std::vector<int>{0, 1, 2, 3}));
}

TEST(Wave, SumsOverTheActiveNeighboursOfTheStepBefore) {
  // Diamond 0 - {1, 2} - 3, and 1 - 2, which become active together and do not interact.
  NeighbourLists links(4);
  link(links, 0, 1, 1.0);
  link(links, 0, 2, 2.0);
  link(links, 1, 3, 0.3);
  link(links, 2, 3, 0.1);
  link(links, 1, 2, 0.01);
  const std::vector<char> all_free(4, 0);
  const std::vector<int> goals{3};
  const Wave wave = expand_wave(links, all_free, {}, 0, goals);
  EXPECT_NEAR(wave.v[1], std::exp(-0.3), kWeight);
  EXPECT_NEAR(wave.v[2], std::exp(-0.1), kWeight);
  EXPECT_NEAR(wave.v[0], std::exp(-1.3) + std::exp(-2.1), kWeight);
  // Backward search goes to the neighbour that is excited most, 2, though the way by 1 is shorter.
  EXPECT_EQ(follow_wave(links, wave, 0), (std::vector<int>{0, 2, 3}));
}

TEST(Wave, CheaperNodesAreExcitedMore) {
  NeighbourLists links(4);
  link(links, 0, 1, 1.0);
  link(links, 0, 2, 1.0);
  link(links, 1, 3, 1.0);
  link(links, 2, 3, 0.9);
  const std::vector<char> all_free(4, 0);
  const std::vector<int> goals{3};
  EXPECT_EQ(follow_wave(links, expand_wave(links, all_free, {}, 0, goals), 0)[1], 2);
  const std::vector<double> cost{1.0, 0.5, 1.0, 1.0};
  EXPECT_EQ(follow_wave(links, expand_wave(links, all_free, cost, 0, goals), 0)[1], 1);
}

TEST(Wave, TakesAsManyStepsAsBreadthFirstSearchAndAvoidsInhibitedNodes) {
  const Linkage links = connect(halton(2, 500, 11), 4);
  std::vector<char> inhibited(500, 0);
  for (std::size_t i = 0; i < 500; i += 9) inhibited[i] = 1;
  const int start = 1, goal = 498;
  const std::vector<int> expected = hops(links, inhibited, goal);
  const std::vector<int> goals{goal};
  const Wave wave = expand_wave(links, inhibited, {}, start, goals);
  ASSERT_GT(expected[1], 3) << "a case worth testing";
  ASSERT_TRUE(wave.reached);
  EXPECT_EQ(wave.arrival[1], expected[1]);
  const std::vector<int> path = follow_wave(links, wave, start);
  EXPECT_EQ(static_cast<int>(path.size()), expected[1] + 1);
  for (const int i : path) EXPECT_FALSE(inhibited[static_cast<std::size_t>(i)]);
  EXPECT_EQ(path.back(), goal);
}

TEST(Wave, DoesNotReachAStartThatIsCutOff) {
  NeighbourLists links(3);
  link(links, 0, 1, 1.0);
  link(links, 1, 2, 1.0);
  const std::vector<char> middle_off{0, 1, 0};
  const std::vector<int> goals{2};
  const Wave wave = expand_wave(links, middle_off, {}, 0, goals);
  EXPECT_FALSE(wave.reached);
  EXPECT_TRUE(follow_wave(links, wave, 0).empty());
}

TEST(Wave, EndsAtTheNearestOfSeveralGoals) {
  NeighbourLists links(4);
  link(links, 0, 1, 1.0);
  link(links, 1, 2, 1.0);
  link(links, 0, 3, 1.0);
  const std::vector<char> all_free(4, 0);
  const std::vector<int> goals{2, 3};
  EXPECT_EQ(follow_wave(links, expand_wave(links, all_free, {}, 0, goals), 0),
            (std::vector<int>{0, 3}));
}

}  // namespace
}  // namespace mimesis::planner
