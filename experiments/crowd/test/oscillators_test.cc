#include "experiments/crowd/oscillators.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <numbers>
#include <vector>

#include "common/math/circle.h"
#include "common/math/integrator.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(HopfNetwork, IsTheKroneckerLaplacianOfTheStates) {  // eq. 4.24 with L = L_G ⊗ I
  const dmp::AndronovHopf oscillator{6.0};
  const Eigen::Matrix2Xd x = Eigen::Matrix2Xd::Random(2, 6);
  const HopfLeader leader{0.4, {0.3, -0.9}};
  for (const Topology topology :
       {Topology::chain, Topology::ring, Topology::star, Topology::wheel, Topology::all_to_all}) {
    const auto graph = CouplingGraph::make(topology, 6);
    Eigen::Matrix2Xd rate(2, 6);
    hopf_network_rate(graph, oscillator, 0.7, leader, x, rate);
    Eigen::Matrix2Xd expected = -0.7 * x * graph.laplacian();
    for (int i = 0; i < 6; ++i) {
      expected.col(i) += oscillator.rate(x.col(i)) + 0.4 * (leader.x - x.col(i));
    }
    EXPECT_LT((rate - expected).norm(), 1e-12) << to_string(topology);
  }
}

TEST(HopfNetwork, WeightsCount) {
  const std::vector<Edge> edges{{0, 1, 2.5}};
  const auto graph = CouplingGraph::weighted(2, edges);
  const Eigen::Matrix2Xd x = (Eigen::Matrix2Xd(2, 2) << 1.0, 0.0, 0.0, 1.0).finished();
  Eigen::Matrix2Xd rate(2, 2);
  hopf_network_rate(graph, {0.0}, 1.0, {}, x, rate);
  EXPECT_NEAR(rate(0, 0), -2.5, 1e-15);
  EXPECT_NEAR(rate(1, 0), 2.5, 1e-15);
}

TEST(WarpedCycle, DistanceFromTheCycleDecaysAtAlphaAtAnySpeedOfThePhase) {
  // half an ellipse of axes 2 and 1 above: F = (1 + 3 sin² φ)/4 [M18 fig. 4.12]
  const auto cycle = [](double phi) {
    const double s = std::sin(phi);
    return WarpedCycle{(1.0 + 3.0 * s * s) / 4.0, 1.5 * s * std::cos(phi), 0.3};
  };
  const auto phase = [](double t) { return 2.0 * t + 0.5 * std::sin(t); };
  const auto f = [&](double t, double rho) {
    return warped_rate(cycle(phase(t)), 2.0 + 0.5 * std::cos(t), rho);
  };
  double rho = 3.0, t = 0.0;
  const double off = rho - cycle(phase(0.0)).rho;
  for (int n = 0; n < 1000; ++n, t += 0.01) rho = math::rk4_step(f, t, rho, 0.01);
  EXPECT_NEAR(rho - cycle(phase(t)).rho, off * std::exp(-0.3 * t), 1e-7);
}

TEST(WarpedCycle, PlainOneIsTheOscillator) {  // ρ̇ = 2 (1 − ρ) is ṙ = r (1 − r²) [M18 4.3.1]
  for (const double r : {0.3, 1.0, 1.8}) {
    const double rho_rate = warped_rate({}, 5.0, 1.0 / (r * r));
    EXPECT_NEAR(r * (1.0 - r * r), -0.5 * r * r * r * rho_rate, 1e-14);
  }
}

TEST(WarpedCycle, CoupledPhasesTakeTheWholeToSynchrony) {
  // hierarchical: phases by rule III, radii follow [M18 4.5]
  const auto graph = CouplingGraph::make(Topology::ring, 4);
  using State = Eigen::Array<double, 8, 1>;  // φ, then ρ
  const auto cycle = [](double phi) {
    return WarpedCycle{1.0 + 0.5 * std::sin(phi), 0.5 * std::cos(phi), 0.8};
  };
  const auto f = [&](double, const State& x) {
    State rate = State::Zero();
    rate.head<4>() = 6.0;
    add_phase_coupling(graph, 0.5, {x.data(), 4}, {}, {rate.data(), 4});
    for (int i = 0; i < 4; ++i) rate[4 + i] = warped_rate(cycle(x[i]), rate[i], x[4 + i]);
    return rate;
  };
  State x;
  x << 0.0, 2.0, -2.5, 1.0, 0.2, 4.0, 1.0, 2.0;
  for (int n = 0; n < 2000; ++n) x = math::rk4_step(f, 0.0, x, 0.01);
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(math::wrap_pi(x[i] - x[0]), 0.0, 1e-6);
    EXPECT_NEAR(x[4 + i], cycle(x[i]).rho, 1e-5);
  }
  EXPECT_GT(std::abs(x[0]), kPi);  // has run on
}

}  // namespace
}  // namespace mimesis::crowd
