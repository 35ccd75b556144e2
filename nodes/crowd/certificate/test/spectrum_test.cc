#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>
#include <random>

#include "common/error.h"
#include "nodes/crowd/certificate/contraction.h"

namespace mimesis::crowd {
namespace {

constexpr Topology kNamed[] = {Topology::chain, Topology::ring, Topology::star, Topology::wheel,
                               Topology::all_to_all};

Eigen::VectorXd by_eigen(const Eigen::MatrixXd& laplacian) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(laplacian, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

TEST(Spectrum, ClosedFormsAreEigenvaluesOfTheLaplacian) {
  for (const Topology topology : kNamed) {
    for (int n = topology == Topology::wheel ? 4 : 1; n <= 17; ++n) {
      const CouplingGraph graph = CouplingGraph::make(topology, n);
      const Eigen::VectorXd exact = by_eigen(graph.laplacian());
      if (n < 2) continue;
      const Extremes e = extremes(graph);
      EXPECT_NEAR(e.least, exact[1], 1e-12 * n) << to_string(topology) << ' ' << n;
      EXPECT_NEAR(e.most, exact[n - 1], 1e-12 * n) << to_string(topology) << ' ' << n;
      EXPECT_TRUE(e.exact);
    }
  }
}

TEST(Spectrum, ConnectivityOfTable41) {
  const double pi = std::numbers::pi;
  for (int n = 3; n <= 10; ++n) {
    EXPECT_NEAR(extremes(Topology::star, n).least, 1.0, 1e-14);
    EXPECT_NEAR(extremes(Topology::all_to_all, n).least, n, 1e-14);
    EXPECT_NEAR(extremes(Topology::chain, n).least, 2 * (1 - std::cos(pi / n)), 1e-14);
    EXPECT_NEAR(extremes(Topology::ring, n).least, 2 * (1 - std::cos(2 * pi / n)), 1e-14);
  }
}

TEST(Spectrum, DirectedGraphsContractInTheMetricOfTheirLeftNullVector) {
  for (int n = 3; n <= 9; ++n) {  // a ring whose agents hear the next: half of the ring
    std::vector<Edge> edges;
    for (int i = 0; i < n; ++i) edges.push_back({i, (i + 1) % n});
    const Extremes e = extremes(CouplingGraph::weighted(n, edges, true));
    EXPECT_NEAR(e.least, 1.0 - std::cos(2.0 * std::numbers::pi / n), 1e-12);
    EXPECT_NEAR(e.skew, 1.0, 1e-12);
  }
  // Two agents, weights 1 and 3: x₁ − x₀ decays at 4; π = (3, 1)/4.
  const Edge pair[] = {{0, 1, 1.0}, {1, 0, 3.0}};
  const Extremes two = extremes(CouplingGraph::weighted(2, pair, true));
  EXPECT_NEAR(two.least, 4.0, 1e-12);
  EXPECT_NEAR(two.skew, std::sqrt(3.0), 1e-12);
  const Edge followers[] = {{1, 0}, {2, 1}};
  const CouplingGraph column = CouplingGraph::weighted(3, followers, true);
  EXPECT_TRUE(column.connected());
  EXPECT_FALSE(column.strongly_connected());
  EXPECT_EQ(extremes(column).least, 0.0);
  const Edge apart[] = {{2, 0}, {2, 1}};  // nobody hears both of those whom agent 2 hears
  EXPECT_FALSE(CouplingGraph::weighted(3, apart, true).connected());
}

TEST(Spectrum, DisconnectedGraphHasNoConnectivity) {
  const Edge edges[] = {{0, 1}, {2, 3}};
  EXPECT_EQ(extremes(CouplingGraph::weighted(4, edges)).least, 0.0);
  EXPECT_GT(extremes(CouplingGraph::weighted(4, edges)).most, 1.9);
  EXPECT_THROW((void)extremes(Topology::weighted, 4), ConfigError);
  EXPECT_THROW((void)extremes(Topology::wheel, 3), ConfigError);
}

CouplingGraph random_graph(int n, double share, std::mt19937& random) {
  std::vector<Edge> edges;
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int i = 1; i < n; ++i) edges.push_back({i - 1, i, 0.5 + uniform(random)});
  for (int i = 0; i < n; ++i) {
    for (int j = i + 2; j < n; ++j) {
      if (uniform(random) < share) edges.push_back({i, j, 0.5 + uniform(random)});
    }
  }
  return CouplingGraph::weighted(n, edges);
}

TEST(Spectrum, BoundsOfLargeGraphsEncloseTheEigenvalues) {
  std::mt19937 random(3);
  for (const int n : {601, 640}) {
    const CouplingGraph graph = random_graph(n, 0.01, random);
    const Extremes bounds = extremes(graph);
    const Eigen::VectorXd exact = by_eigen(graph.laplacian());
    EXPECT_FALSE(bounds.exact);
    EXPECT_GT(bounds.least, 0.0);
    EXPECT_LE(bounds.least, exact[1]);
    EXPECT_GE(bounds.most, exact[n - 1]);
  }
}

TEST(Spectrum, InterlacesWhenALinkGoes) {  // [M18 A.7], and Weyl's bound
  std::mt19937 random(11);
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::MatrixXd with = random_graph(12, 0.3, random).laplacian();
    const int i = trial % 10;  // a link of the chain inside
    const double w = -with(i, i + 1);
    Eigen::MatrixXd without = with;
    without(i, i) -= w, without(i + 1, i + 1) -= w;
    without(i, i + 1) = without(i + 1, i) = 0.0;
    const Eigen::VectorXd a = by_eigen(with), b = by_eigen(without);
    for (int k = 1; k < 12; ++k) {
      EXPECT_LE(b[k], a[k] + 1e-12);
      EXPECT_GE(b[k], a[k - 1] - 1e-12);
    }
    EXPECT_GE(b[1], a[1] - 2.0 * w - 1e-12);  // by Weyl's theorem [M18 A.6]
  }
}

TEST(Spectrum, WorstLinkToLose) {
  for (const Topology topology : kNamed) {
    for (int n = 4; n <= 9; ++n) {
      const CouplingGraph graph = CouplingGraph::make(topology, n);
      const Eigen::MatrixXd all = graph.laplacian();
      double least = 1e9;
      for (int i = 0; i < n; ++i) {
        for (int j = i + 1; j < n; ++j) {
          if (all(i, j) == 0.0) continue;
          Eigen::MatrixXd without = all;
          without(i, i) -= 1.0, without(j, j) -= 1.0;
          without(i, j) = without(j, i) = 0.0;
          least = std::min(least, by_eigen(without)[1]);
        }
      }
      EXPECT_NEAR(connectivity_without_link(graph), least, 1e-12)
          << to_string(topology) << ' ' << n;
    }
  }
  EXPECT_EQ(connectivity_without_link(CouplingGraph::make(Topology::ring, 2)), 0.0);
  std::mt19937 random(7);
  const CouplingGraph large = random_graph(40, 0.9, random);
  const double bound = connectivity_without_link(large);
  EXPECT_GT(bound, 0.0);
  EXPECT_LT(bound, extremes(large).least);
}

TEST(Spectrum, LostAgentCostsAtMostOne) {  // [Fiedler]
  for (const Topology topology : {Topology::ring, Topology::wheel, Topology::all_to_all}) {
    for (int n = 5; n < 12; ++n) {
      const Eigen::MatrixXd all = CouplingGraph::make(topology, n).laplacian();
      for (int gone = 0; gone < n; ++gone) {
        std::vector<Edge> edges;
        const auto index = [&](int i) { return i < gone ? i : i - 1; };
        for (int i = 0; i < n; ++i) {
          for (int j = i + 1; j < n; ++j) {
            if (i != gone && j != gone && all(i, j) < 0) edges.push_back({index(i), index(j)});
          }
        }
        EXPECT_GE(extremes(CouplingGraph::weighted(n - 1, edges)).least,
                  by_eigen(all)[1] - 1.0 - 1e-12);
      }
    }
  }
}

}  // namespace
}  // namespace mimesis::crowd
