#include "nodes/planner/path_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <queue>

#include "nodes/planner/roadmap.h"
#include "nodes/planner/smooth_path.h"
#include "nodes/planner/test/arms.h"

namespace mimesis::planner {
namespace {

constexpr double kPathMargin = 0.002;

/// A wall of 16 balls across the workspace, as in fig. 2.7: the arm must fold to pass under it.
Obstacles wall() {
  Obstacles obstacles;
  for (int i = 0; i < 16; ++i) obstacles.balls.push_back({{1.2 + 0.04 * i, 0.1, 0.0}, 0.05});
  return obstacles;
}

Roadmap planar_roadmap(CollisionChecker& checker, std::uint64_t seed = 1) {
  RoadmapSettings settings;
  settings.nodes = 600;
  settings.seed = seed;
  settings.refinement.window_rad = 0.4;
  return build_roadmap(checker, Eigen::MatrixXd(2, 0), settings);
}

const Eigen::Vector2d kBelow(-0.5, 0.2), kAbove(0.6, 0.2);

TEST(RefineOffline, MovesInhibitedNodesOutAndDropsTheRest) {  // fig. 2.10
  const auto arm = planar_arm();
  CollisionChecker checker(arm, wall(), kPathMargin);
  const auto free = [&](const Eigen::MatrixXd& q) { return checker.free_columns(q); };
  Eigen::MatrixXd nodes = sample_box(arm.q_min, arm.q_max, 800, 2);
  RefinementSettings settings;
  settings.window_rad = 0.4;
  const auto shares = refine_offline(nodes, arm.q_min, arm.q_max, free, settings);
  EXPECT_GT(shares.front(), 0.03);
  EXPECT_LT(shares.back(), 0.02);
  EXPECT_LE(shares.size(), 10u) << "usually just a few iterations are needed";
  EXPECT_GE(nodes.cols(), 784) << "nearly all nodes survive";
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    EXPECT_TRUE(checker.free(nodes.col(i)));
    EXPECT_TRUE((nodes.col(i).array() >= arm.q_min.array()).all() &&
                (nodes.col(i).array() <= arm.q_max.array()).all());
  }
}

TEST(RefineOffline, ShiftsAwayFromTheInhibitedAndTowardsTheActive) {
  // One coordinate: inhibited at 0 and 0.1, active at 0.5. v2 = 0.1, v3 = 0.4: 0.1 moves to 0.6; 0
  // moves by v2 = -0.1 and v3 = 0.5 to 0.4.
  Eigen::MatrixXd nodes(1, 3);
  nodes << 0.0, 0.1, 0.5;
  const auto free = [](const Eigen::MatrixXd& q) {
    std::vector<char> far;
    for (Eigen::Index i = 0; i < q.cols(); ++i) far.push_back(q(0, i) > 0.2);
    return far;
  };
  RefinementSettings settings{.window_rad = 1.0, .inhibited_share = 0.01};
  const auto shares = refine_offline(nodes, Eigen::VectorXd::Constant(1, -1),
                                     Eigen::VectorXd::Constant(1, 1), free, settings);
  EXPECT_EQ(shares.size(), 2u);
  ASSERT_EQ(nodes.cols(), 3);
  EXPECT_NEAR(nodes(0, 0), 0.4, 1e-12);
  EXPECT_NEAR(nodes(0, 1), 0.6, 1e-12);
}

TEST(FindPath, GoesRoundTheObstacleAndEveryPartIsCertified) {
  const auto arm = planar_arm();
  CollisionChecker checker(arm, wall(), kPathMargin);
  ASSERT_FALSE(checker.certify(kBelow, kAbove)) << "the straight line is blocked";
  const Roadmap roadmap = planar_roadmap(checker);
  const std::vector<Eigen::VectorXd> goals{kAbove};
  const auto found = find_path(roadmap, checker, kBelow, goals, {}, {});
  ASSERT_TRUE(found) << found.error().reason;
  EXPECT_GT(found->waves, 0);
  EXPECT_EQ(found->waypoints.front(), kBelow);
  EXPECT_EQ(found->waypoints.back(), kAbove);
  for (std::size_t i = 1; i < found->waypoints.size(); ++i) {
    EXPECT_TRUE(CollisionChecker(arm, wall(), kPathMargin - 1e-6)
                    .certify(found->waypoints[i - 1], found->waypoints[i]));
  }
  // The forearm must fold so far that the tip stays nearer than the wall: the way is not much
  // longer.
  EXPECT_LT(path_length(found->waypoints), 6.0);
}

TEST(FindPath, NeedsNoRoadmap) {
  const auto arm = planar_arm();
  CollisionChecker checker(arm, wall(), kPathMargin);
  std::vector<std::vector<Eigen::VectorXd>> paths;
  for (const std::uint64_t seed : {1u, 1u, 2u}) {
    const std::vector<Eigen::VectorXd> goals{Eigen::Vector2d(0.06, 0.0), kAbove};
    const auto found = find_path({}, checker, kBelow, goals, {}, {.shortcuts = 0, .seed = seed});
    ASSERT_TRUE(found) << found.error().reason;
    EXPECT_EQ(found->by, FoundBy::trees);
    EXPECT_EQ(found->goal, 1);
    EXPECT_EQ(found->waypoints.front(), kBelow);
    EXPECT_EQ(found->waypoints.back(), kAbove);
    for (std::size_t i = 1; i < found->waypoints.size(); ++i) {
      EXPECT_TRUE(checker.certify(found->waypoints[i - 1], found->waypoints[i]));
      EXPECT_GT((found->waypoints[i] - found->waypoints[i - 1]).norm(), 1e-9);
    }
    paths.push_back(found->waypoints);
  }
  EXPECT_EQ(paths[0], paths[1]);
  EXPECT_NE(paths[0], paths[2]);
}

TEST(Network, OneWaveIsEnoughWhereALinkIsBlocked) {
  const auto arm = planar_arm();
  CollisionChecker checker(arm, wall(), kPathMargin);
  const std::vector<Eigen::VectorXd> goals{kAbove};
  const auto round = find_path({}, checker, kBelow, goals, {}, {});
  ASSERT_TRUE(round);
  // Two ways of as many links: along the straight line, shorter, its last link blocked; and round.
  const auto middles = static_cast<int>(round->waypoints.size()) - 2;
  const int goal = 1 + 2 * middles;
  ASSERT_GT(middles, 0);
  Eigen::MatrixXd nodes(2, goal + 1);
  nodes.col(0) = kBelow;
  nodes.col(goal) = kAbove;
  NeighbourLists lists(static_cast<std::size_t>(goal) + 1);
  const auto join = [&](int a, int b) {
    const double length = (nodes.col(a) - nodes.col(b)).norm();
    lists[static_cast<std::size_t>(a)].push_back({b, length});
    lists[static_cast<std::size_t>(b)].push_back({a, length});
  };
  for (int i = 1; i <= middles; ++i) {
    nodes.col(i) = kBelow + 0.01 * i * (kAbove - kBelow);
    nodes.col(middles + i) = round->waypoints[static_cast<std::size_t>(i)];
    join(i == 1 ? 0 : i - 1, i);
    join(i == 1 ? 0 : middles + i - 1, middles + i);
  }
  join(middles, goal);
  join(2 * middles, goal);
  ASSERT_FALSE(checker.certify(nodes.col(middles), nodes.col(goal)));
  const Roadmap roadmap(nodes, lists);
  const std::vector<char> free = checker.free_columns(nodes);
  ASSERT_EQ(std::ranges::count(free, 0), 0);
  const PostureCost no_preference;
  Network network(checker, no_preference);
  network.take(roadmap, free);
  EXPECT_EQ(follow_wave(roadmap.links(),
                        expand_wave(roadmap.links(), std::vector<char>(free.size(), 0), {}, 0,
                                    std::span(&goal, 1)),
                        0)[1],
            1)
      << "the shorter way is excited more";
  int waves = 1;
  const std::vector<int> path = network.search(0, std::span(&goal, 1), waves);
  ASSERT_EQ(std::ssize(path), middles + 2);
  for (int i = 1; i <= middles; ++i) EXPECT_EQ(path[static_cast<std::size_t>(i)], middles + i);
  EXPECT_EQ(path.back(), goal);
}

TEST(FindPath, SameSeedSameBits) {
  const auto arm = planar_arm();
  std::vector<std::vector<Eigen::VectorXd>> paths;
  for (const std::uint64_t seed : {1u, 1u, 2u}) {
    CollisionChecker checker(arm, wall(), kPathMargin);
    const std::vector<Eigen::VectorXd> goals{kAbove};
    SearchSettings settings;
    settings.seed = seed;
    const auto found =
        find_path(planar_roadmap(checker, seed), checker, kBelow, goals, {}, settings);
    ASSERT_TRUE(found);
    paths.push_back(found->waypoints);
  }
  EXPECT_EQ(paths[0], paths[1]);
  EXPECT_NE(paths[0], paths[2]);
}

TEST(FindPath, GoesStraightWhereItCan) {
  const auto arm = planar_arm();
  CollisionChecker checker(arm, {}, kPathMargin);
  const std::vector<Eigen::VectorXd> goals{kAbove};
  const auto found = find_path(planar_roadmap(checker), checker, kBelow, goals, {}, {});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->waves, 0);
  EXPECT_EQ(found->waypoints.size(), 2u);
}

TEST(FindPath, SaysWhyThereIsNone) {
  const auto arm = planar_arm();
  CollisionChecker checker(arm, wall(), kPathMargin);
  const Roadmap roadmap = planar_roadmap(checker);
  const Eigen::VectorXd inside = Eigen::Vector2d(0.06, 0.0), below = kBelow, above = kAbove;
  const auto reason = [&](const Eigen::VectorXd& start, const std::vector<Eigen::VectorXd>& goals) {
    const auto found = find_path(roadmap, checker, start, goals, {}, {});
    return found ? "found a path" : found.error().reason;
  };
  EXPECT_EQ(reason(inside, {above}).substr(0, 71),
            "the start posture is in collision: ball 15 (fore) touches the obstacle ");
  EXPECT_EQ(reason(below, {inside, inside}),
            "of the postures at the goal all 2 are inhibited: " + *checker.contact(inside));
  const Eigen::VectorXd bent = Eigen::Vector2d(0.02, 0.05);
  ASSERT_NE(checker.contact(bent), checker.contact(inside));
  const std::string both = reason(below, {inside, bent, inside});
  EXPECT_NE(both.find(*checker.contact(inside) + " (2)"), std::string::npos) << both;
  EXPECT_NE(both.find(*checker.contact(bent) + " (1)"), std::string::npos) << both;
  EXPECT_EQ(reason(below, {}), "no posture reaches the goal");

  Obstacles cage;  // on both sides of the base, nearer than the elbow
  for (double x = 0.45; x < 1.9; x += 0.05) {
    cage.balls.push_back({{x, 0.1, 0.0}, 0.05});
    cage.balls.push_back({{-x, 0.1, 0.0}, 0.05});
  }
  CollisionChecker caged(arm, cage, kPathMargin);
  const std::vector<Eigen::VectorXd> goals{kAbove};
  const auto none =
      find_path(planar_roadmap(caged), caged, kBelow, goals, {}, {.max_branches = 2000});
  ASSERT_FALSE(none);
  const std::string& torn = none.error().reason;
  EXPECT_TRUE(torn.starts_with("no path within the allowed effort; on the straight way ")) << torn;
  EXPECT_NE(torn.find(") touches the obstacle ball at "), std::string::npos) << torn;
}

TEST(FindPath, EndsWhenItIsTold) {
  const auto arm = planar_arm();
  Obstacles cage;
  for (double x = 0.45; x < 1.9; x += 0.05) {
    cage.balls.push_back({{x, 0.1, 0.0}, 0.05});
    cage.balls.push_back({{-x, 0.1, 0.0}, 0.05});
  }
  CollisionChecker whole(arm, cage, kPathMargin);
  const std::vector<Eigen::VectorXd> goals{kAbove};
  const Roadmap roadmap = planar_roadmap(whole);
  for (const Roadmap& map : {Roadmap{}, roadmap}) {
    int asked = 0;
    long postures = 0, most = 0;  // since it was asked before
    CollisionChecker* at_work = nullptr;
    const auto asks = [&] {
      most = std::max(most, at_work->postures_checked() - postures);
      postures = at_work->postures_checked();
      return ++asked > 200;
    };
    CollisionChecker checker(arm, cage, kPathMargin, {"it was told", asks});
    at_work = &checker;
    const auto found = find_path(map, checker, kBelow, goals, {}, {.max_branches = 1'000'000'000});
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().reason, "it was told");
    EXPECT_EQ(checker.postures_checked(), postures) << "nothing after it was told";
    EXPECT_LE(most, kLanes) << "asked before each batch";
  }
}

TEST(FindPath, TakesTheGoalThatCanBeReached) {
  const auto arm = planar_arm();
  CollisionChecker checker(arm, wall(), kPathMargin);
  const std::vector<Eigen::VectorXd> goals{Eigen::Vector2d(0.06, 0.0), kAbove};
  const auto found = find_path(planar_roadmap(checker), checker, kBelow, goals, {}, {});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->goal, 1);
}

TEST(Shortened, KeepsEndsAndNeverLengthens) {
  const auto outside_disc = [](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    const double u = std::clamp(-a.dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
    return (a + u * (b - a)).norm() >= 1.0;
  };
  const std::vector<Eigen::VectorXd> detour{Eigen::Vector2d(-2, 0), Eigen::Vector2d(-2, 3),
                                            Eigen::Vector2d(0, 4), Eigen::Vector2d(2, 3),
                                            Eigen::Vector2d(2, 0)};
  const auto path = shortened(detour, outside_disc, 400, 1);
  EXPECT_EQ(path.front(), detour.front());
  EXPECT_EQ(path.back(), detour.back());
  for (std::size_t i = 1; i < path.size(); ++i) EXPECT_TRUE(outside_disc(path[i - 1], path[i]));
  // The shortest way round the unit disc: two tangents of √3 and an arc of π/3.
  const double shortest = 2.0 * std::sqrt(3.0) + M_PI / 3.0;
  EXPECT_GE(path_length(path), shortest);
  EXPECT_LT(path_length(path), 1.05 * shortest);
}

constexpr double kWeight = 1e-7;         // weights are stored in single precision
const std::vector<char> kAllFree(4, 0);  // of four nodes
const std::vector<int> kLast{3};

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
  const Wave wave = expand_wave(links, kAllFree, {}, 0, kLast);
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
  const Wave wave = expand_wave(links, kAllFree, {}, 0, kLast);
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
  EXPECT_EQ(follow_wave(links, expand_wave(links, kAllFree, {}, 0, kLast), 0)[1], 2);
  const std::vector<double> cost{1.0, 0.5, 1.0, 1.0};
  EXPECT_EQ(follow_wave(links, expand_wave(links, kAllFree, cost, 0, kLast), 0)[1], 1);
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
  const std::vector<int> goals{2, 3};
  EXPECT_EQ(follow_wave(links, expand_wave(links, kAllFree, {}, 0, goals), 0),
            (std::vector<int>{0, 3}));
}

Eigen::MatrixXd on_a_line(std::initializer_list<double> xs) {
  Eigen::MatrixXd nodes(1, static_cast<Eigen::Index>(xs.size()));
  std::copy(xs.begin(), xs.end(), nodes.data());
  return nodes;
}

double strength(const Neighbour& to) { return -to.length; }
double strength(const Link& link) { return link.weight; }

const auto* find_link(const auto& links, std::size_t from, int to) {
  const auto list = std::span(links[from]);
  const auto link = std::ranges::find(list, to, [](const auto& l) { return l.to; });
  return link == list.end() ? nullptr : &*link;
}

void expect_symmetric(const auto& links) {
  for (std::size_t i = 0; i < links.size(); ++i) {
    for (const auto& link : links[i]) {
      const auto* back = find_link(links, static_cast<std::size_t>(link.to), static_cast<int>(i));
      ASSERT_NE(back, nullptr) << i << " -> " << link.to;
      EXPECT_EQ(strength(*back), strength(link));
    }
  }
}

TEST(NearestNeighbours, AreThoseOfASortOverAllPairs) {
  const Eigen::MatrixXd nodes = halton(3, 200, 7);
  const NeighbourLists lists = nearest_neighbours(nodes, 5);
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    std::vector<std::pair<double, int>> all;
    for (Eigen::Index j = 0; j < nodes.cols(); ++j) {
      if (j != i) all.emplace_back((nodes.col(i) - nodes.col(j)).norm(), static_cast<int>(j));
    }
    std::sort(all.begin(), all.end());
    const auto& list = lists[static_cast<std::size_t>(i)];
    ASSERT_EQ(list.size(), 5u);
    for (std::size_t k = 0; k < 5; ++k) {
      EXPECT_EQ(list[k].to, all[k].second);
      EXPECT_NEAR(list[k].length, all[k].first, 1e-12);
    }
  }
}

TEST(NearestNeighbours, OfFewNodesAreAllOthers) {
  EXPECT_EQ(nearest_neighbours(on_a_line({0.0, 1.0}), 8)[0].size(), 1u);
  EXPECT_TRUE(nearest_neighbours(on_a_line({0.0}), 8)[0].empty());
  EXPECT_TRUE(nearest_neighbours(Eigen::MatrixXd(2, 0), 8).empty());
}

TEST(Symmetrised, AddsTheReverseOfOneSidedLinks) {
  // 1 is the nearest of 0, but the nearest of 1 is 2.
  const Eigen::MatrixXd nodes = on_a_line({0.0, 1.0, 1.5});
  const NeighbourLists lists = nearest_neighbours(nodes, 1);
  EXPECT_EQ(find_link(lists, 1, 0), nullptr);
  const NeighbourLists links = symmetrised(lists, 1);
  expect_symmetric(links);
  EXPECT_NE(find_link(links, 1, 0), nullptr);
}

TEST(Pruned, RemovesTheLongSideOfObtuseTrianglesOnly) {
  Eigen::MatrixXd obtuse(2, 3), acute(2, 3);
  obtuse << 0.0, 1.0, 2.0, 0.0, 0.2, 0.0;
  acute << 0.0, 1.0, 2.0, 0.0, 1.5, 0.0;
  const NeighbourLists without = pruned(symmetrised(nearest_neighbours(obtuse, 2), 2));
  EXPECT_EQ(find_link(without, 0, 2), nullptr);
  EXPECT_EQ(find_link(without, 2, 0), nullptr);
  EXPECT_NE(find_link(without, 0, 1), nullptr);
  const NeighbourLists whole = pruned(symmetrised(nearest_neighbours(acute, 2), 2));
  EXPECT_EQ(whole[0].size() + whole[1].size() + whole[2].size(), 6u);
}

TEST(JoinClusters, AddsTheShortestLinkOfEveryPair) {
  // Two groups of three; with k = 1 they are apart, with 2k = 3 extended neighbours they see each
  // other.
  const Eigen::MatrixXd nodes = on_a_line({0.0, 0.1, 0.2, 1.0, 1.1, 1.2});
  const NeighbourLists extended = nearest_neighbours(nodes, 3);
  NeighbourLists links = symmetrised(extended, 1);
  EXPECT_EQ(clusters(links), (std::vector<int>{0, 0, 0, 1, 1, 1}));
  join_clusters(links, extended);
  EXPECT_EQ(clusters(links), std::vector<int>(6, 0));
  EXPECT_NE(find_link(links, 2, 3), nullptr);  // 0.8, the shortest
  EXPECT_EQ(find_link(links, 1, 3), nullptr);
  expect_symmetric(links);
}

TEST(Clusters, LeaveInhibitedNodesOut) {
  const NeighbourLists links = symmetrised(nearest_neighbours(on_a_line({0.0, 1.0, 2.0}), 2), 1);
  const std::vector<char> middle_off{0, 1, 0};
  EXPECT_EQ(clusters(links, middle_off), (std::vector<int>{0, -1, 1}));
}

TEST(Connect, GivesASymmetricTriangleFreeNetwork) {
  const Eigen::MatrixXd nodes = halton(4, 600, 3);
  const Linkage links = connect(nodes, 4);
  expect_symmetric(links);
  const auto cluster = clusters(links);
  EXPECT_EQ(*std::max_element(cluster.begin(), cluster.end()), 0) << "one cluster";
}

}  // namespace
}  // namespace mimesis::planner
