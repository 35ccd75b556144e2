#include <gtest/gtest.h>

#include <algorithm>

#include "experiments/fields/situations.h"
#include "nodes/cognition/test/wired.h"

namespace mimesis::cognition {
namespace {

/// Every situation with its own message.
template <class Real>
void expect_all(const NetworkSpec& network, const char* what) {
  const Constants constants{.network = network};
  for (const Situation& s : situations()) {
    FieldNetwork<Real> practised_network = practised<Real>(constants, s.practice);
    EXPECT_EQ(sites_of(run_trial(practised_network, s.trial)), s.expected)
        << "fig. " << s.figure << ", " << s.what << ", " << what << ", dt " << network.dt_s;
  }
}

TEST(Robustness, DISABLED_SlowDecisionsDependNeitherOnTheStepNorOnThePrecision) {
  NetworkSpec network = load_network();
  for (const double dt_s : {0.001, 0.002, 0.005}) {
    network.dt_s = dt_s;
    expect_all<float>(network, "float");
    expect_all<double>(network, "double");
  }
}

TEST(Robustness, DISABLED_SlowDecisionsDoNotDependOnTheFormOfTheLinks) {
  expect_all<double>(wired(load_network()), "low rank");
}

TEST(Robustness,
     DISABLED_SlowFiguresSurviveJitteredGains) {  // `mimesis reproduce fields-jitter` tries 100
  constexpr unsigned kFirstSeed = 1;
  for (unsigned i = 0; i < 10; ++i) {
    Constants constants;
    constants.network.dt_s = 0.005;
    const auto held = figures_that_hold<float>(jittered(constants, kFirstSeed + i, 0.05));
    EXPECT_EQ(std::ranges::count(held, "all"), 1) << "seed " << kFirstSeed + i;
  }
}

}  // namespace
}  // namespace mimesis::cognition
