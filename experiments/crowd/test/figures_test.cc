// All rows of all figures, and the helpers that measure. Figures that take longer than some seconds
// are the slow suite, as in experiments/motion.
#include "experiments/crowd/figures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "experiments/crowd/crowds.h"
#include "experiments/crowd/hopf_trials.h"
#include "experiments/crowd/statistics.h"

namespace mimesis::crowd {
namespace {

const std::set<std::string> kSlow = {"fig-4.5", "fig-4.6", "head-on", "random-starts", "table-4.1"};

std::vector<std::string> names() {
  std::vector<std::string> out;
  for (const reproduce::Figure& figure : figures()) {
    if (figure.name != "crowd-scaling") out.push_back(figure.name);  // times, not numbers
  }
  return out;
}

class FigureRows : public testing::TestWithParam<std::string> {};

TEST_P(FigureRows, Hold) {
  const auto all = figures();
  const reproduce::Report report =
      std::ranges::find(all, GetParam(), &reproduce::Figure::name)->run(std::nullopt);
  EXPECT_FALSE(report.rows.empty());
  EXPECT_TRUE(report.plots.empty());
  for (const reproduce::Row& row : report.rows) {
    EXPECT_TRUE(row.passed) << row.what << ": " << row.ours << " of " << row.reference.value << ' '
                            << row.unit;
  }
}

std::string test_name(const testing::TestParamInfo<std::string>& info) {
  std::string name = info.param;
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  return name;
}
std::vector<std::string> chosen(bool slow) {
  auto all = names();
  std::erase_if(all, [slow](const std::string& name) { return kSlow.contains(name) != slow; });
  return all;
}
INSTANTIATE_TEST_SUITE_P(Quick, FigureRows, testing::ValuesIn(chosen(false)), test_name);
INSTANTIATE_TEST_SUITE_P(DISABLED_Slow, FigureRows, testing::ValuesIn(chosen(true)), test_name);

TEST(Figures, AreThoseThatWereAskedFor) {
  const auto all = names();
  const std::set<std::string> have(all.begin(), all.end());
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
  EXPECT_NEAR(median(o.rate_1_s), 1.6, 0.008);
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
  EXPECT_EQ(median({3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(median({4.0, 1.0, 2.0, 3.0}), 2.5);
  EXPECT_TRUE(std::isnan(median({})));
}

}  // namespace
}  // namespace mimesis::crowd
