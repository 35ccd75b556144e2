#include "nodes/crowd/rules/rules.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "common/math/circle.h"
#include "common/math/integrator.h"
#include "common/testing/no_malloc.h"

namespace mimesis::crowd {
namespace {

constexpr double kPi = std::numbers::pi;
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
        if (spread(view(phi)) <= 1e-3) ++in_step;
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
      if (spread(view(phi)) <= 1e-3 && std::abs(math::wrap_pi(phi[0] - 0.3)) < 1e-3) ++led;
    }
    EXPECT_EQ(led, 500) << to_string(topology);
  }
}

TEST(PhaseCoupling, LeaderPullsAtAlphaAndTheGroupAtKNPlusAlpha) {  // not kN + α for both
  const auto graph = CouplingGraph::make(Topology::all_to_all, 3);
  const Phases phi = Phases::Constant(3, 0.3) + 1e-4 * Eigen::Vector3d(3.0, 1.0, 2.0);
  Phases rate = Phases::Zero(3);
  add_phase_coupling(graph, 0.35, view(phi), {0.25, 0.3}, view(rate));
  EXPECT_NEAR(rate.mean(), -0.25 * 2e-4, 1e-11);  // reaction to the mean, 2e-4 ahead
  EXPECT_NEAR((rate[0] - rate[1]) / 2e-4, -(0.35 * 3 + 0.25), 1e-6);
}

TEST(PhaseCoupling, AllToAllLeavesTheMeanAlone) {  // except for the wrapping on the circle
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

TEST(Synchrony, DispersionIsTheDissertationsAndKeepsItsDigits) {
  const std::vector<double> phi{0.3, 1.0, 5.0};
  const double r = std::abs(std::polar(1.0, 0.3) + std::polar(1.0, 1.0) + std::polar(1.0, 5.0)) / 3;
  EXPECT_NEAR(dispersion(phi), std::sqrt(1.0 - r), 1e-14);
  const std::vector<double> close{2.0 - 1e-9, 2.0 + 1e-9};
  EXPECT_NEAR(dispersion(close) / (1e-9 / std::sqrt(2.0)), 1.0, 1e-6);
}

TEST(Synchrony, AcrossTheCutOfTheAngle) {
  EXPECT_LE(spread(std::vector<double>{3.14, -3.14}), 0.01);
  EXPECT_GT(spread(std::vector<double>{3.0, -3.0}), 0.01);
  EXPECT_EQ(spread(std::vector<double>{1.0}), 0.0);
}

TEST(Lane, TheSlidingGoalIsOnTheLine) {
  const auto turn = [](double psi, double to_lane) {
    return lane_turn(0.7, 6.0, cos_sin_lane(psi - 0.4), to_lane, 2.0);
  };
  EXPECT_NEAR(turn(0.4, 0.0).rate_rad_s, 0.0, 1e-15);  // on its line, along the path
  EXPECT_NEAR(turn(0.4, 0.0).facing, 1.0, 1e-15);
  const double goal = 0.4 - kPi / 4;  // left of the line: to the right
  EXPECT_NEAR(turn(goal, -2.0).rate_rad_s, 0.0, 1e-14);
  EXPECT_NEAR(turn(0.1, -2.0).rate_rad_s, 6.0 * 0.7 * std::sin(goal - 0.1), 1e-14);
  EXPECT_NEAR(turn(0.1, -2.0).facing, std::cos(goal - 0.1), 1e-15);
}

TEST(Lane, WalksOntoItsLine) {  // ξ̇ = v sin ψ
  const auto f = [&](double, const Eigen::Vector2d& x) {
    return Eigen::Vector2d(1.3 * std::sin(x[1]),
                           lane_turn(1.0, 6.0, cos_sin_lane(x[1]), -x[0], 2.0).rate_rad_s);
  };
  Eigen::Vector2d x(1.5, -2.0);
  for (int n = 0; n < 1500; ++n) x = math::rk4_step(f, 0.0, x, 0.01);
  EXPECT_LT(x.norm(), 1e-3);
}

TEST(Consensus, TurnsToTheCommonDirection) {
  EXPECT_NEAR(consensus_turn(0.7, 6.0, cos_sin_lane(0.1), cos_sin_lane(0.4)),
              6.0 * 0.7 * std::sin(0.3), 1e-14);
}

TEST(Goal, TurnsToItsPlace) {
  const Turn turn = goal_turn(0.8, cos_sin_lane(0.3), 3.0, 4.0, 1.0 / 5.0);
  EXPECT_NEAR(turn.rate_rad_s, 0.8 * std::sin(std::atan2(4.0, 3.0) - 0.3), 1e-14);
  EXPECT_NEAR(turn.facing, std::cos(std::atan2(4.0, 3.0) - 0.3), 1e-14);
}

TEST(HeadingCoupling, ContractsAtKLambdaNearAgreement) {
  for (const double sigma : {0.0, 0.8}) {
    for (const Topology topology : {Topology::chain, Topology::ring, Topology::all_to_all}) {
      const auto graph = CouplingGraph::make(topology, 5);
      const HeadingRule rule{.gain = 0.6, .spread_rad = sigma};
      const Eigen::VectorXd psi = Eigen::VectorXd::Constant(5, kPi) +
                                  1e-4 * Eigen::VectorXd::LinSpaced(5, -1.0, 2.0).cwiseAbs();
      Eigen::VectorXd rate = Eigen::VectorXd::Zero(5);
      {
        const testing::NoMalloc guard;
        add_heading_coupling(graph, rule, view(psi), view(rate));
      }
      EXPECT_LT((rate + 0.6 * graph.laplacian() * psi).norm(), 1e-10) << to_string(topology);
    }
  }
}

TEST(HeadingCoupling, MeanFieldIsTheSumOverPairs) {
  const auto graph = CouplingGraph::make(Topology::all_to_all, 4);
  const Eigen::VectorXd psi = Eigen::Vector4d(0.2, 2.9, -3.0, 1.0);
  Eigen::VectorXd rate = Eigen::VectorXd::Zero(4), shunted = Eigen::VectorXd::Zero(4);
  const CircularSum sum = circular_sum(view(psi));
  add_heading_coupling(graph, {.gain = 0.7}, view(psi), view(rate));
  add_heading_coupling(graph, {.gain = 0.7, .spread_rad = 0.5}, view(psi), view(shunted));
  for (int i = 0; i < 4; ++i) {
    double plain = 0.0, gaussian = 0.0;
    for (int j = 0; j < 4; ++j) {
      const double off = math::wrap_pi(psi[i] - psi[j]);
      plain -= 0.7 * std::sin(off);
      gaussian -= 0.7 * std::sin(off) * std::exp(-2.0 * off * off);
    }
    EXPECT_NEAR(rate[i], plain, 1e-13);
    EXPECT_NEAR(coupled_turn(0.7, cos_sin_lane(psi[i]), {sum.cos, sum.sin}), plain, 1e-13);
    EXPECT_NEAR(shunted[i], gaussian, 1e-13);
  }
}

TEST(HeadingCoupling, WeightsCount) {
  const std::vector<Edge> edges{{0, 1, 2.0}};
  const Eigen::VectorXd psi = Eigen::Vector2d(0.0, 0.3);
  Eigen::VectorXd rate = Eigen::VectorXd::Zero(2);
  add_heading_coupling(CouplingGraph::weighted(2, edges), {.gain = 0.5}, view(psi), view(rate));
  EXPECT_NEAR(rate[0], std::sin(0.3), 1e-15);
  EXPECT_NEAR(rate[1], -std::sin(0.3), 1e-15);
}

TEST(Spacing, ErrorIsTheLaplacianOfTheMisplacement) {
  const Eigen::VectorXd z = Eigen::VectorXd::LinSpaced(6, 3.0, -2.0).array().cube();
  const Eigen::VectorXd d = Eigen::VectorXd::LinSpaced(6, 0.0, 7.5);
  for (const Topology topology :
       {Topology::chain, Topology::ring, Topology::star, Topology::wheel, Topology::all_to_all}) {
    const auto graph = CouplingGraph::make(topology, 6);
    Eigen::VectorXd error(6);
    {
      const testing::NoMalloc guard;
      spacing_errors(graph, view(z), view(d), {error.data(), 6});
    }
    for (int i = 0; i < 6; ++i) {
      double expected = 0.0;
      for (int j = 0; j < 6; ++j) {
        double weight = graph.complete() && i != j ? 1.0 : 0.0;
        for (const auto& other : graph.neighbours(i)) {
          if (other.index == j) weight = other.weight;
        }
        expected += weight * (z[i] - z[j] - (d[i] - d[j]));
      }
      EXPECT_NEAR(error[i], expected, 1e-12);
    }
  }
}

TEST(Spacing, OneWhoIsAheadSlowsDownByFrequencyAndLength) {
  EXPECT_DOUBLE_EQ(frequency_change(0.3, 2.0), -0.6);
  EXPECT_DOUBLE_EQ(step_length_change(0.1, 0.5, 2.0), -0.2);
  EXPECT_DOUBLE_EQ(step_length_change(0.1, 0.5, -20.0), 0.5);
  EXPECT_DOUBLE_EQ(step_length_change(0.1, 0.5, 20.0), -0.5);
}

TEST(Spacing, SaturationIsOddAndLimitedAndOneAtZero) {
  for (const double e : {0.01, 0.5, 40.0}) {
    EXPECT_DOUBLE_EQ(saturate(-e, 2.0), -saturate(e, 2.0));
    EXPECT_LE(saturate(e, 2.0), 2.0);
    // logistic of [M10] with γ = 2/limit, centred
    EXPECT_NEAR(saturate(e, 2.0), 4.0 / (1.0 + std::exp(-e)) - 2.0, 1e-12);
    EXPECT_DOUBLE_EQ(saturate(e, 0.0), e);
  }
  EXPECT_NEAR(saturate(1e-6, 2.0), 1e-6, 1e-15);
  EXPECT_NEAR(frequency_change(0.5, saturate(1e9, 2.0)), -1.0, 1e-12);
}

TEST(Spacing, LowPassGoesToTheError) {
  const double share = low_pass_share(3.0 * 0.02);
  EXPECT_NEAR(low_passed(0.5, 2.0, share), 2.0 - 1.5 * std::exp(-0.06), 1e-15);
  EXPECT_DOUBLE_EQ(low_passed(2.0, 2.0, share), 2.0);
}

}  // namespace
}  // namespace mimesis::crowd
