#include "nodes/crowd/rules/heading.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <numbers>
#include <vector>

#include "common/math/integrator.h"
#include "common/testing/no_malloc.h"
#include "nodes/crowd/rules/synchrony.h"

namespace mimesis::crowd {
namespace {

constexpr double kPi = std::numbers::pi;
using Vec = Eigen::VectorXd;
std::span<const double> view(const Vec& v) { return {v.data(), std::size_t(v.size())}; }
std::span<double> view(Vec& v) { return {v.data(), std::size_t(v.size())}; }

TEST(Lane, TheSlidingGoalIsOnTheLine) {
  EXPECT_NEAR(sliding_goal(0.4, 0.0, 2.0), 0.4, 1e-15);
  EXPECT_NEAR(sliding_goal(0.4, 2.0, 2.0), 0.4 - kPi / 4, 1e-15);  // left of the line: to the right
  const HeadingRule rule{.kind = HeadingKind::lane, .gain = 0.7};
  EXPECT_GT(lane_rate(rule, 6.0, 0.0, 0.2), 0.0);
  EXPECT_NEAR(lane_rate(rule, 6.0, 0.1, 0.4, 0.05), 6.0 * (0.7 * std::sin(0.3) + 0.05), 1e-14);
}

TEST(Lane, WalksOntoItsLine) {  // ξ̇ = v sin ψ
  const HeadingRule rule{.kind = HeadingKind::lane, .gain = 1.0, .ahead_m = 2.0};
  const auto f = [&](double, const Eigen::Vector2d& x) {
    return Eigen::Vector2d(1.3 * std::sin(x[1]),
                           lane_rate(rule, 6.0, x[1], sliding_goal(0.0, x[0], rule.ahead_m)));
  };
  Eigen::Vector2d x(1.5, -2.0);
  for (int n = 0; n < 1500; ++n) x = math::rk4_step(f, 0.0, x, 0.01);
  EXPECT_LT(x.norm(), 1e-3);
}

TEST(Consensus, LowPassGoesTheShortWayRound) {
  const HeadingRule rule{.low_pass_s = 0.5};
  EXPECT_NEAR(consensus_rate(rule, 3.0, -3.0), (2 * kPi - 6.0) / 0.5, 1e-12);
  EXPECT_NEAR(consensus_rate(rule, 1.0, 0.5), -1.0, 1e-12);
}

TEST(HeadingCoupling, ContractsAtKLambdaNearAgreement) {
  for (const double sigma : {0.0, 0.8}) {
    for (const Topology topology : {Topology::chain, Topology::ring, Topology::all_to_all}) {
      const auto graph = CouplingGraph::make(topology, 5);
      const HeadingRule rule{.gain = 0.6, .spread_rad = sigma};
      const Vec psi = Vec::Constant(5, kPi) + 1e-4 * Vec::LinSpaced(5, -1.0, 2.0).cwiseAbs();
      Vec rate = Vec::Zero(5);
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
  const Vec psi = Eigen::Vector4d(0.2, 2.9, -3.0, 1.0);
  Vec rate = Vec::Zero(4), shunted = Vec::Zero(4);
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
    EXPECT_NEAR(shunted[i], gaussian, 1e-13);
  }
}

TEST(HeadingCoupling, WeightsCount) {
  const std::vector<Edge> edges{{0, 1, 2.0}};
  const Vec psi = Eigen::Vector2d(0.0, 0.3);
  Vec rate = Vec::Zero(2);
  add_heading_coupling(CouplingGraph::weighted(2, edges), {.gain = 0.5}, view(psi), view(rate));
  EXPECT_NEAR(rate[0], std::sin(0.3), 1e-15);
  EXPECT_NEAR(rate[1], -std::sin(0.3), 1e-15);
}

}  // namespace
}  // namespace mimesis::crowd
