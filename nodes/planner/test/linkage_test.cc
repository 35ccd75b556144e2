#include <gtest/gtest.h>

#include <algorithm>

#include "nodes/planner/roadmap.h"

namespace mimesis::planner {
namespace {

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
