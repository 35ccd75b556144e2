#include "experiments/motion/oscillators.h"

#include <gtest/gtest.h>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/testing/no_malloc.h"
#include "experiments/motion/oscillator_network.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kOscillatorsPi = std::numbers::pi;
using VdpNetwork = OscillatorNetwork<VanDerPol>;
using HopfNetwork = OscillatorNetwork<AndronovHopf>;

/// Time between the first upward zero crossings of x (by linear interpolation), averaged.
template <class Network>
double period(Network& network, double dt, int steps) {
  double first = -1.0, last = -1.0;
  int crossings = 0;
  double before = network.state(0)[0];
  for (int n = 1; n <= steps; ++n) {
    network.step();
    const double now = network.state(0)[0];
    if (before < 0.0 && now >= 0.0) {
      last = dt * (n - now / (now - before));
      if (crossings++ == 0) first = last;
    }
    before = now;
  }
  return (last - first) / (crossings - 1);
}

TEST(VanDerPol, SmallDampingGivesAmplitudeAndPeriodOfPerturbationTheory) {
  constexpr double kDt = 1e-3;
  for (const Integrator method : {Integrator::rk4, Integrator::adams_bashforth5}) {
    const VanDerPol oscillator{.nu = 4.0, .rho = 0.5, .omega_rad_s = 5.0};
    VdpNetwork network({oscillator}, Eigen::MatrixXd::Zero(1, 1), kDt, method);
    network.set_state(0, {0.3, 0.0});
    for (int n = 0; n < 20'000; ++n) network.step();
    double amplitude = 0.0;
    for (int n = 0; n < 3000; ++n) {
      network.step();
      amplitude = std::max(amplitude, network.state(0)[0]);
    }
    const double mu = oscillator.nu * oscillator.rho / oscillator.omega_rad_s;  // 0.4
    EXPECT_NEAR(amplitude, 2.0 * std::sqrt(0.5), 0.01);
    // ω/ω₀ = 1 − µ²/16 + 17µ⁴/3072
    const double expected = 1.0 - mu * mu / 16.0 + 17.0 * std::pow(mu, 4) / 3072.0;
    EXPECT_NEAR(2.0 * kOscillatorsPi / period(network, kDt, 30'000) / 5.0, expected, 1e-5);
  }
}

TEST(VanDerPol, ScaledPhasePlaneIsNearlyTheUnitCircleRunCounterclockwise) {
  VdpNetwork network({VanDerPol{.nu = 0.5, .rho = 0.25, .omega_rad_s = 6.0}},
                     Eigen::MatrixXd::Zero(1, 1), 0.01);
  for (int n = 0; n < 5000; ++n) network.step();
  double before = network.phase(0);
  for (int n = 0; n < 200; ++n) {
    network.step();
    EXPECT_NEAR(network.circle(0).norm(), 1.0, 0.01);
    EXPECT_NEAR(math::wrap_pi(network.phase(0) - before), 0.06, 0.002);
    before = network.phase(0);
  }
}

TEST(VanDerPol, VelocityCouplingSynchronizesThree) {  // eq. 3.13
  std::vector<VanDerPol> three(3, VanDerPol{.nu = 1.0, .rho = 0.25, .omega_rad_s = 6.0});
  auto spread_after = [&](double k, double seconds) {
    VdpNetwork network(three, all_to_all(3, k), 0.005);
    network.set_phase(1, 1.0);
    network.set_phase(2, -1.5);
    for (int n = 0; n < seconds / 0.005; ++n) network.step();
    return std::max(std::abs(math::wrap_pi(network.phase(1) - network.phase(0))),
                    std::abs(math::wrap_pi(network.phase(2) - network.phase(0))));
  };
  EXPECT_GT(spread_after(0.0, 20.0), 1.0);
  EXPECT_LT(spread_after(0.5, 20.0), 1e-4);
}

TEST(VanDerPol, DifferentFrequenciesLockToOne) {
  std::vector<VanDerPol> two{{.nu = 1.0, .rho = 0.25, .omega_rad_s = 6.0},
                             {.nu = 1.0, .rho = 0.25, .omega_rad_s = 6.3}};
  auto drift = [&](double k) {  // drift of the phase difference, over 20 s after 20 s [rad]
    VdpNetwork network(two, all_to_all(2, k), 0.005);
    double from = 0.0, turned = 0.0, before = 0.0;
    for (int n = 0; n < 8000; ++n) {
      network.step();
      const double d = network.phase(1) - network.phase(0);
      turned += math::wrap_pi(d - before);
      before = d;
      if (n == 3999) from = turned;
    }
    return turned - from;
  };
  EXPECT_NEAR(drift(0.0), 0.3 * 20.0, 0.4);
  EXPECT_NEAR(drift(1.0), 0.0, 0.05);
}

TEST(AndronovHopf, RadiusAndPhaseFollowTheClosedForm) {
  constexpr double kDt = 0.01, kR0 = 0.2;
  for (const Integrator method : {Integrator::rk4, Integrator::adams_bashforth5}) {
    HopfNetwork network({AndronovHopf{7.0}}, Eigen::MatrixXd::Zero(1, 1), kDt, method);
    network.set_state(0, {0.0, kR0});
    for (int n = 1; n <= 300; ++n) {
      network.step();
      const double t = n * kDt;
      const double r = 1.0 / std::sqrt(1.0 + (1.0 / (kR0 * kR0) - 1.0) * std::exp(-2.0 * t));
      ASSERT_NEAR(network.state(0).norm(), r, 2e-5) << t;
      ASSERT_NEAR(math::wrap_pi(network.phase(0) - 0.5 * kOscillatorsPi - 7.0 * t), 0.0, 1e-4) << t;
    }
  }
}

TEST(AndronovHopf, LeavesOfAStarFollowTheirLeaderWhoHeedsNobody) {
  HopfNetwork network(std::vector<AndronovHopf>(5, AndronovHopf{6.0}), star(5, 3.0), 0.01);
  for (int i = 1; i < 5; ++i) network.set_phase(i, 0.7 * i);
  for (int n = 0; n < 500; ++n) network.step();
  EXPECT_NEAR(math::wrap_pi(network.phase(0) - 30.0), 0.0, 1e-4);
  for (int i = 1; i < 5; ++i) {
    EXPECT_LT((network.state(i) - network.state(0)).norm(), 1e-5) << i;
  }
}

TEST(AndronovHopf, DiffusivelyCoupledPairLocksWithTheExpectedLag) {
  // on the circle φ̇ᵢ = ωᵢ + k r sin(φⱼ − φᵢ): Δω = 2k sin Δφ
  HopfNetwork network({AndronovHopf{6.0}, AndronovHopf{6.4}}, all_to_all(2, 1.0), 0.01);
  for (int n = 0; n < 3000; ++n) network.step();
  EXPECT_NEAR(math::wrap_pi(network.phase(1) - network.phase(0)), std::asin(0.4 / 2.0), 2e-3);
}

TEST(OscillatorNetwork, AnExternalLeaderPullsAnyOscillator) {
  VdpNetwork leader({VanDerPol{}}, Eigen::MatrixXd::Zero(1, 1), 0.005);
  VdpNetwork seven(std::vector<VanDerPol>(7), all_to_all(7, 1.5), 0.005);
  leader.set_phase(0, 2.0);
  for (int n = 0; n < 16'000; ++n) {  // only one of seven feels the leader: 80 s
    seven.set_external(0, leader.state(0), 2.0);
    leader.step();
    seven.step();
  }
  for (int i = 0; i < 7; ++i) {
    // held for a step: half a step behind, 0.015 rad
    EXPECT_NEAR(math::wrap_pi(seven.phase(i) - leader.phase(0)), -0.015, 0.01) << i;
  }
}

TEST(OscillatorNetwork, StepsWithoutAllocation) {
  HopfNetwork hopf(std::vector<AndronovHopf>(8), star(8, 2.0), 0.005);
  VdpNetwork vdp(std::vector<VanDerPol>(7), all_to_all(7, 1.0), 0.005,
                 Integrator::adams_bashforth5);
  const mimesis::testing::NoMalloc guard;
  for (int n = 0; n < 10; ++n) {
    hopf.step();
    vdp.step();
  }
}

TEST(OscillatorNetwork, RefusesWhatItCannotIntegrate) {
  const std::vector<AndronovHopf> two(2);
  EXPECT_THROW(HopfNetwork({}, {}, 0.01), ConfigError);
  EXPECT_THROW(HopfNetwork(two, all_to_all(3, 1.0), 0.01), ConfigError);
  EXPECT_THROW(HopfNetwork(two, -all_to_all(2, 1.0), 0.01), ConfigError);
  EXPECT_THROW(HopfNetwork(two, Eigen::MatrixXd::Identity(2, 2), 0.01), ConfigError);
  EXPECT_THROW(HopfNetwork(two, all_to_all(2, 20.0), 0.01, Integrator::adams_bashforth5),
               ConfigError);
  EXPECT_NO_THROW(HopfNetwork(two, all_to_all(2, 20.0), 0.01));
}

}  // namespace
}  // namespace mimesis::synthesizer
