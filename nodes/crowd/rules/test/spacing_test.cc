#include "nodes/crowd/rules/spacing.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "common/testing/no_malloc.h"

namespace mimesis::crowd {
namespace {

std::span<const double> view(const Eigen::VectorXd& v) { return {v.data(), std::size_t(v.size())}; }

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
  const FrequencyRule frequency{.gain_rad_m_s = 0.3};
  EXPECT_DOUBLE_EQ(frequency_change(frequency, 2.0), -0.6);
  const LengthRule length{.gain_1_m = 0.1, .limit = 0.5};
  EXPECT_DOUBLE_EQ(step_length_change(length, 2.0), -0.2);
  EXPECT_DOUBLE_EQ(step_length_change(length, -20.0), 0.5);
  EXPECT_DOUBLE_EQ(step_length_change(length, 20.0), -0.5);
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
  const FrequencyRule rule{.gain_rad_m_s = 0.5, .saturation_m = 2.0};
  EXPECT_NEAR(frequency_change(rule, 1e9), -1.0, 1e-12);
}

TEST(Spacing, LowPassGoesToTheError) {
  const FrequencyRule rule{.low_pass_rad_s = 3.0};
  EXPECT_DOUBLE_EQ(low_pass_rate(rule, 0.5, 2.0), 4.5);
  EXPECT_DOUBLE_EQ(low_pass_rate(rule, 2.0, 2.0), 0.0);
}

TEST(Spacing, FormationErrorIsTheWorstDistance) {
  const std::vector<double> z{5.0, 7.0, 1.0}, d{0.0, 2.5, -4.0};
  EXPECT_DOUBLE_EQ(formation_error(z, d), 0.5);
  EXPECT_EQ(formation_error({}, {}), 0.0);
}

}  // namespace
}  // namespace mimesis::crowd
