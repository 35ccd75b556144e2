// All rows of all figures, and the helpers that measure. Figures that take longer than some seconds
// are the slow suite, as in experiments/motion.
#include "experiments/crowd/figures.h"

#include <algorithm>
#include <set>

#include "experiments/crowd/crowds.h"
#include "experiments/crowd/hopf_trials.h"
#include "experiments/harness/statistics.h"
#include "experiments/harness/test/figure_rows.h"

namespace mimesis::crowd {
namespace {

const std::set<std::string> kSlow = {"crowd-streams", "fig-4.5",       "fig-4.6",
                                     "head-on",       "random-starts", "table-4.1"};

std::vector<reproduce::Figure> repeatable() {
  auto all = figures();
  std::erase_if(all,
                [](const auto& f) { return f.name == "crowd-scaling"; });  // times, not numbers
  return all;
}

class FigureRows : public testing::TestWithParam<reproduce::Figure> {};

TEST_P(FigureRows, Hold) { reproduce::expect_rows_hold(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Quick, FigureRows,
                         testing::ValuesIn(reproduce::chosen(repeatable(), kSlow, false)),
                         reproduce::test_name);
INSTANTIATE_TEST_SUITE_P(DISABLED_Slow, FigureRows,
                         testing::ValuesIn(reproduce::chosen(repeatable(), kSlow, true)),
                         reproduce::test_name);

TEST(Figures, AreThoseThatWereAskedFor) {
  const auto all = repeatable();
  std::set<std::string> have;
  for (const auto& f : all) have.insert(f.name);
  EXPECT_EQ(have.size(), all.size());
  for (const char* name :
       {"table-4.1", "fig-4.3", "fig-4.5", "fig-4.6", "fig-4.7", "fig-4.11", "fig-4.12", "fig-4.13",
        "fig-4.14", "low-pass", "divergence", "consensus", "formation-16", "formation-36",
        "formation-49", "random-starts", "circle-250", "head-on"}) {
    EXPECT_TRUE(have.contains(name)) << name;
  }
}

TEST(Figures, SameNumbersEveryTime) {
  const HopfTrials trials{.topology = Topology::ring, .n = 4, .trials = 3};
  EXPECT_EQ(run(trials).rate_1_s, run(trials).rate_1_s);
}

TEST(HopfTrials, RateOfAPairIsTwiceTheCoupling) {
  const HopfOutcome o = run({.topology = Topology::chain, .n = 2, .k_1_s = 0.8, .trials = 20});
  EXPECT_EQ(o.synchronised, 20);
  EXPECT_NEAR(reproduce::median(o.rate_1_s), 1.6, 0.008);
}

TEST(HopfTrials, WeakCouplingOnARingLeavesTwistedStates) {  // below the bound nothing is promised
  const HopfOutcome o = run({.topology = Topology::ring,
                             .n = 10,
                             .k_1_s = 0.3 / printed_lambda(Topology::ring, 10),
                             .trials = 100,
                             .until_s = 60.0,
                             .dt_s = 0.05});
  EXPECT_LT(o.synchronised, 100);
  EXPECT_GT(o.synchronised, 75);
}

TEST(TiedCrowd, PhasesAndPlacesStayTied) {
  const std::vector<double> places{0.0, -1.0, -2.5};
  const SpeedFunction gait = gait_of(0.3);
  Crowd crowd = tied_crowd({.graph = {Topology::ring}, .gain_rad_m_s = 2.0}, gait, places,
                           std::vector{0.3, 1.0, 2.0}, 0.01);
  for (int n = 0; n < 500; ++n) crowd.step();
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(crowd.x_m()[i], gait.integral(crowd.phase_rad()[i]) + places[i], 1e-6);
  }
  EXPECT_LT(formation_error_m(crowd), 0.05);
}

TEST(Statistics, MedianOfEvenAndOdd) {
  EXPECT_EQ(reproduce::median({3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(reproduce::median({4.0, 1.0, 2.0, 3.0}), 2.5);
  EXPECT_TRUE(std::isnan(reproduce::median({})));
}

}  // namespace
}  // namespace mimesis::crowd
