#include <gtest/gtest.h>

#include <algorithm>

#include "experiments/fields/situations.h"
#include "nodes/cognition/test/wired.h"

namespace mimesis::cognition {
namespace {

/// Every situation with its own message.
template <class Real>
void expect_all(const Architecture& ladder, const char* what) {
  const Constants constants{.ladder = ladder};
  for (const Situation& s : situations()) {
    Ladder<Real> practised_ladder = practised<Real>(constants, s.practice);
    EXPECT_EQ(sites_of(run_trial(practised_ladder, s.trial)), s.expected)
        << "fig. " << s.figure << ", " << s.what << ", " << what << ", dt " << ladder.dt_s;
  }
}

TEST(Robustness, DecisionsDependNeitherOnTheStepNorOnThePrecision) {
  Architecture ladder = load_architecture();
  for (const double dt_s : {0.001, 0.002, 0.005}) {
    ladder.dt_s = dt_s;
    expect_all<float>(ladder, "float");
    expect_all<double>(ladder, "double");
  }
}

TEST(Robustness, DecisionsDoNotDependOnTheFormOfTheLinks) {
  expect_all<double>(wired(load_architecture()), "low rank");
}

TEST(Robustness, FiguresSurviveJitteredGains) {  // `mimesis reproduce fields-jitter` tries 100
  constexpr unsigned kFirstSeed = 1;
  for (unsigned i = 0; i < 10; ++i) {
    Constants constants;
    constants.ladder.dt_s = 0.005;
    const auto held = figures_that_hold<float>(jittered(constants, kFirstSeed + i, 0.05));
    EXPECT_EQ(std::ranges::count(held, "all"), 1) << "seed " << kFirstSeed + i;
  }
}

}  // namespace
}  // namespace mimesis::cognition
