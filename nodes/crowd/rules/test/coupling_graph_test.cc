#include "nodes/crowd/rules/coupling_graph.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/error.h"
#include "common/testing/refusal.h"

namespace mimesis::crowd {
namespace {

constexpr Topology kNamed[] = {Topology::none, Topology::chain, Topology::ring,
                               Topology::star, Topology::wheel, Topology::all_to_all};

Eigen::MatrixXd laplacian(Topology topology, int n) {
  return CouplingGraph::make(topology, n).laplacian();
}

/// Adjacency by the definitions of [M18 fig. 4.4], link by link.
bool linked(Topology topology, int i, int j, int n) {
  const int apart = std::abs(i - j);
  switch (topology) {
    case Topology::chain:
      return apart == 1;
    case Topology::ring:
      return apart == 1 || apart == n - 1;
    case Topology::star:
      return (i == 0) != (j == 0);
    case Topology::wheel:
      return (i == 0) != (j == 0) || (i > 0 && j > 0 && (apart == 1 || apart == n - 2));
    case Topology::all_to_all:
      return true;
    default:
      return false;
  }
}

TEST(CouplingGraph, LaplacianIsDegreesMinusAdjacency) {
  for (const Topology topology : kNamed) {
    for (int n = topology == Topology::wheel ? 4 : 2; n < 10; ++n) {
      Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(n, n);
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
          if (i == j || !linked(topology, i, j, n)) continue;
          expected(i, j) -= 1.0;
          expected(i, i) += 1.0;
        }
      }
      EXPECT_EQ(laplacian(topology, n), expected) << to_string(topology) << ' ' << n;
    }
  }
}

TEST(CouplingGraph, DegreesAndNeighboursAreThoseOfTheLaplacian) {
  for (const Topology topology : kNamed) {
    const CouplingGraph graph = CouplingGraph::make(topology, 7);
    const Eigen::MatrixXd l = graph.laplacian();
    for (int i = 0; i < 7; ++i) {
      EXPECT_EQ(graph.degree(i), l(i, i));
      if (graph.complete()) continue;
      EXPECT_EQ(graph.neighbours(i).size(), static_cast<std::size_t>(l(i, i)));
      for (const auto& other : graph.neighbours(i)) EXPECT_EQ(l(i, other.index), -other.weight);
    }
  }
  EXPECT_TRUE(CouplingGraph::make(Topology::all_to_all, 7).neighbours(3).empty());
}

TEST(CouplingGraph, SmallOnes) {
  EXPECT_EQ(laplacian(Topology::ring, 2), laplacian(Topology::chain, 2));  // not a double link
  EXPECT_EQ(laplacian(Topology::ring, 3), laplacian(Topology::all_to_all, 3));
  EXPECT_EQ(laplacian(Topology::wheel, 4), laplacian(Topology::all_to_all, 4));
  for (const Topology topology : {Topology::chain, Topology::ring, Topology::star}) {
    EXPECT_EQ(laplacian(topology, 1), Eigen::MatrixXd::Zero(1, 1));
    EXPECT_EQ(CouplingGraph::make(topology, 0).size(), 0);
  }
}

TEST(CouplingGraph, WeightedSumsItsEdges) {
  const Edge edges[] = {{0, 2, 0.5}, {2, 1, 3.0}, {3, 1, 0.0}};
  const CouplingGraph graph = CouplingGraph::weighted(4, edges);
  const Eigen::Matrix4d expected =
      (Eigen::Matrix4d() << 0.5, 0, -0.5, 0, 0, 3, -3, 0, -0.5, -3, 3.5, 0, 0, 0, 0, 0).finished();
  EXPECT_EQ(graph.laplacian(), expected);
  EXPECT_EQ(graph.degree(2), 3.5);
  EXPECT_TRUE(graph.neighbours(3).empty());  // weight 0 is no edge
  EXPECT_FALSE(graph.connected());
}

TEST(CouplingGraph, ConnectedMeansAWayBetweenAllPairs) {
  for (const Topology topology : kNamed) {
    EXPECT_EQ(CouplingGraph::make(topology, 6).connected(), topology != Topology::none);
    EXPECT_TRUE(topology == Topology::wheel || CouplingGraph::make(topology, 1).connected());
  }
  const Edge parts[] = {{0, 1}, {1, 2}, {3, 4}};
  EXPECT_FALSE(CouplingGraph::weighted(5, parts).connected());
  const Edge joined[] = {{0, 1}, {1, 2}, {3, 4}, {4, 0}};
  EXPECT_TRUE(CouplingGraph::weighted(5, joined).connected());
  EXPECT_FALSE(CouplingGraph::weighted(6, joined).connected());
}

TEST(CouplingGraph, RefusesWhatIsNoGraph) {
  const auto refused = [](int n, std::initializer_list<Edge> edges) {
    return mimesis::testing::refusal(
        [&] { (void)CouplingGraph::weighted(n, std::vector<Edge>(edges)); });
  };
  EXPECT_NE(refused(3, {{0, 3}}).find("nodes are 0 to 2"), std::string::npos);
  EXPECT_NE(refused(3, {{-1, 1}}).find("nodes are 0 to 2"), std::string::npos);
  EXPECT_NE(refused(3, {{1, 1}}).find("not coupled to itself"), std::string::npos);
  EXPECT_NE(refused(3, {{0, 1}, {1, 0}}).find("given twice"), std::string::npos);
  EXPECT_NE(refused(3, {{0, 1, -1.0}}).find("not negative"), std::string::npos);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refused(3, {{0, 1, nan}}).find("must be finite"), std::string::npos);
  EXPECT_THROW((void)CouplingGraph::make(Topology::wheel, 3), ConfigError);
  EXPECT_THROW((void)CouplingGraph::make(Topology::ring, -1), ConfigError);
  EXPECT_THROW((void)CouplingGraph::make(Topology::weighted, 3), ConfigError);
}

}  // namespace
}  // namespace mimesis::crowd
