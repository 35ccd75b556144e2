#include <gtest/gtest.h>

#include "common/error.h"
#include "common/math/circle.h"
#include "experiments/motion/oscillator_network.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kOscillatorsPi = std::numbers::pi;

/// Time between the first upward zero crossings of x (by linear interpolation), averaged.
double period(OscillatorNetwork& network, double dt, int steps) {
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
  const VanDerPol oscillator{.nu = 4.0, .rho = 0.5, .omega_rad_s = 5.0};
  OscillatorNetwork network({oscillator}, Eigen::MatrixXd::Zero(1, 1), kDt);
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

TEST(VanDerPol, ScaledPhasePlaneIsNearlyTheUnitCircleRunCounterclockwise) {
  OscillatorNetwork network({VanDerPol{.nu = 0.5, .rho = 0.25, .omega_rad_s = 6.0}},
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
    OscillatorNetwork network(three, all_to_all(3, k), 0.005);
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
    OscillatorNetwork network(two, all_to_all(2, k), 0.005);
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

TEST(OscillatorNetwork, AnExternalLeaderPullsAnyOscillator) {
  OscillatorNetwork leader({VanDerPol{}}, Eigen::MatrixXd::Zero(1, 1), 0.005);
  OscillatorNetwork seven(std::vector<VanDerPol>(7), all_to_all(7, 1.5), 0.005);
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

TEST(OscillatorNetwork, RefusesWhatItCannotIntegrate) {
  const std::vector<VanDerPol> two(2);
  EXPECT_THROW(OscillatorNetwork({}, {}, 0.01), ConfigError);
  EXPECT_THROW(OscillatorNetwork(two, all_to_all(3, 1.0), 0.01), ConfigError);
  EXPECT_THROW(OscillatorNetwork(two, -all_to_all(2, 1.0), 0.01), ConfigError);
  EXPECT_THROW(OscillatorNetwork(two, Eigen::MatrixXd::Identity(2, 2), 0.01), ConfigError);
  EXPECT_THROW(OscillatorNetwork(two, all_to_all(2, 270.0), 0.01), ConfigError);
  EXPECT_NO_THROW(OscillatorNetwork(two, all_to_all(2, 260.0), 0.01));
}

}  // namespace
}  // namespace mimesis::synthesizer
