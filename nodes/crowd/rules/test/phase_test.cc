#include "nodes/crowd/rules/phase.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "common/math/integrator.h"
#include "common/testing/no_malloc.h"
#include "nodes/crowd/rules/synchrony.h"

namespace mimesis::crowd {
namespace {

using Phases = Eigen::VectorXd;
using math::kTwoPi;

std::span<const double> view(const Phases& p) { return {p.data(), std::size_t(p.size())}; }
std::span<double> view(Phases& p) { return {p.data(), std::size_t(p.size())}; }

Phases random_phases(int n, std::mt19937_64& draw) {
  std::uniform_real_distribution<double> uniform(0.0, kTwoPi);
  Phases phi(n);
  for (double& p : phi) p = uniform(draw);
  return phi;
}

/// φ after `seconds` of coupling, without eigenfrequency.
Phases couple(const CouplingGraph& graph, double k, Phases phi, double seconds,
              double alpha = 0.0) {
  constexpr double kDt = 0.01;
  const auto f = [&](double, const Phases& x) {
    Phases rate = Phases::Zero(x.size());
    add_phase_coupling(graph, k, view(x), {alpha, 0.3}, view(rate));
    return rate;
  };
  lift_phases(view(phi));
  for (double t = 0.0; t < seconds; t += kDt) phi = math::rk4_step(f, t, phi, kDt);
  return phi;
}

constexpr Topology kAll[] = {Topology::chain, Topology::ring, Topology::star, Topology::wheel,
                             Topology::all_to_all};

TEST(PhaseCoupling, IsTheLaplacianNearSynchrony) {
  std::mt19937_64 draw(1);
  for (const Topology topology : kAll) {
    const auto graph = CouplingGraph::make(topology, 7);
    const Phases phi = 1e-4 * random_phases(7, draw);
    Phases rate = Phases::Constant(7, 6.0);
    add_phase_coupling(graph, 0.8, view(phi), {}, view(rate));
    const Phases expected = Phases::Constant(7, 6.0) - 0.8 * graph.laplacian() * phi;
    EXPECT_LT((rate - expected).norm(), 1e-10) << to_string(topology);
  }
}

TEST(PhaseCoupling, WeightsCount) {
  const std::vector<Edge> edges{{0, 1, 2.0}, {1, 2, 0.5}};
  const auto graph = CouplingGraph::weighted(3, edges);
  const Phases phi = Eigen::Vector3d(0.0, 0.1, 0.4);
  Phases rate = Phases::Zero(3);
  add_phase_coupling(graph, 3.0, view(phi), {}, view(rate));
  EXPECT_NEAR(rate[0], 3.0 * 2.0 * 0.1, 1e-15);
  EXPECT_NEAR(rate[1], 3.0 * (2.0 * -0.1 + 0.5 * 0.3), 1e-15);
  EXPECT_NEAR(rate[2], 3.0 * 0.5 * -0.3, 1e-15);
}

TEST(PhaseCoupling, SynchronisesFrom500RandomStartsOnEveryGraph) {
  std::mt19937_64 draw(2);
  for (const Topology topology : kAll) {
    for (const int n : {4, 8}) {
      const auto graph = CouplingGraph::make(topology, n);
      const double lambda = topology == Topology::all_to_all ? n
                            : topology == Topology::chain    ? 2 * (1 - std::cos(kTwoPi / 2 / n))
                            : topology == Topology::ring     ? 2 * (1 - std::cos(kTwoPi / n))
                                                             : 1.0;
      int in_step = 0;
      for (int trial = 0; trial < 500; ++trial) {
        const Phases phi = couple(graph, 1.0 / lambda, random_phases(n, draw), 12.0);
        if (in_synchrony(view(phi), 1e-3)) ++in_step;
      }
      EXPECT_EQ(in_step, 500) << to_string(topology) << ' ' << n;
    }
  }
}

TEST(PhaseCoupling, LeaderIsReachedFrom500RandomStarts) {
  std::mt19937_64 draw(3);
  for (const Topology topology : {Topology::all_to_all, Topology::ring}) {
    const auto graph = CouplingGraph::make(topology, 6);
    int led = 0;
    for (int trial = 0; trial < 500; ++trial) {
      const Phases phi = couple(graph, 0.4, random_phases(6, draw), 40.0, 0.5);
      if (in_synchrony(view(phi), 1e-3) && std::abs(math::wrap_pi(phi[0] - 0.3)) < 1e-3) ++led;
    }
    EXPECT_EQ(led, 500) << to_string(topology);
  }
}

TEST(PhaseCoupling, LeaderPullsAtAlphaAndTheGroupAtKNPlusAlpha) {  // not kN + α for both
  const auto graph = CouplingGraph::make(Topology::all_to_all, 3);
  const Phases phi = Phases::Constant(3, 0.3) + 1e-4 * Eigen::Vector3d(3.0, 1.0, 2.0);
  Phases rate = Phases::Zero(3);
  add_phase_coupling(graph, 0.35, view(phi), {0.25, 0.3}, view(rate));
  EXPECT_NEAR(rate.mean(), -0.25 * 2e-4, 1e-11);  // of the mean, 2e-4 ahead
  EXPECT_NEAR((rate[0] - rate[1]) / 2e-4, -(0.35 * 3 + 0.25), 1e-6);
}

TEST(PhaseCoupling, AllToAllLeavesTheMeanAlone) {  // but for what the circle takes
  const auto graph = CouplingGraph::make(Topology::all_to_all, 4);
  const Phases phi = Eigen::Vector4d(0.1, -0.1, 6.3, -6.2);  // turns do not count
  Phases rate = Phases::Zero(4);
  add_phase_coupling(graph, 1.0, view(phi), {}, view(rate));
  EXPECT_LT(std::abs(rate.sum()), 1e-3);
  EXPECT_LT(rate.cwiseAbs().maxCoeff(), 1.0);
}

TEST(LiftPhases, KeepsTheAnglesAndGathersThemInOneTurn) {
  std::mt19937_64 draw(4);
  const Phases before = 5.0 * random_phases(9, draw);
  Phases after = before;
  lift_phases(view(after));
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(math::wrap_pi(after[i] - before[i]), 0.0, 1e-12);
  EXPECT_LE(after.maxCoeff() - after.minCoeff(), kTwoPi);
  Phases close = Eigen::Vector3d(3.1, -3.1, 3.0 + 2.0 * kTwoPi);  // across the cut of the angle
  lift_phases(view(close));
  EXPECT_LT(close.maxCoeff() - close.minCoeff(), 0.3);
  EXPECT_NEAR(nearest_turn(0.1, 100.0), 0.1 + 16.0 * kTwoPi, 1e-12);
}

TEST(PhaseCoupling, DoesNotAllocate) {
  const auto ring = CouplingGraph::make(Topology::ring, 8);
  const auto all = CouplingGraph::make(Topology::all_to_all, 8);
  const Phases phi = Phases::LinSpaced(8, 0.0, 1.0);
  Phases rate = Phases::Zero(8);
  const testing::NoMalloc guard;
  add_phase_coupling(ring, 1.0, view(phi), {1.0, 0.0}, view(rate));
  add_phase_coupling(all, 1.0, view(phi), {1.0, 0.0}, view(rate));
}

TEST(Synchrony, DispersionIsTheDissertationsAndKeepsItsDigits) {
  const std::vector<double> phi{0.3, 1.0, 5.0};
  const double r = std::abs(std::polar(1.0, 0.3) + std::polar(1.0, 1.0) + std::polar(1.0, 5.0)) / 3;
  EXPECT_NEAR(dispersion(phi), std::sqrt(1.0 - r), 1e-14);
  const std::vector<double> close{2.0 - 1e-9, 2.0 + 1e-9};
  EXPECT_NEAR(dispersion(close) / (1e-9 / std::sqrt(2.0)), 1.0, 1e-6);
}

TEST(Synchrony, AcrossTheCutOfTheAngle) {
  EXPECT_TRUE(in_synchrony(std::vector<double>{3.14, -3.14}, 0.01));
  EXPECT_FALSE(in_synchrony(std::vector<double>{3.0, -3.0}, 0.01));
  EXPECT_FALSE(in_synchrony(std::vector<double>{1.0, std::nan("")}, 4.0));
  EXPECT_TRUE(in_synchrony(std::vector<double>{1.0}, 0.0));
}

}  // namespace
}  // namespace mimesis::crowd
