#include "experiments/harness/figure.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mimesis::reproduce {
namespace {

TEST(Figure, RowsJudgeThemselves) {
  EXPECT_TRUE(near("a", 1.05, 1.0, 0.1, "ms").passed);
  EXPECT_FALSE(near("a", 1.15, 1.0, 0.1, "ms").passed);
  EXPECT_FALSE(near("a", NAN, 1.0, 0.1, "ms").passed);
  EXPECT_FALSE(holds("b", false).passed);
  EXPECT_TRUE(at_least("c", 2.0, 1.8, "1", "bound").passed);
  EXPECT_FALSE(at_least("c", NAN, 1.8, "1", "bound").passed);
  EXPECT_FALSE(at_most("c", 2.0, 1.8, "1", "bound").passed);
  EXPECT_FALSE(at_least("c", 2.0, 1.8, "1", "bound").reference.has_value());
  EXPECT_TRUE(within("d", 1.8, 1.8, "1", "limit").passed);
  EXPECT_FALSE(within("d", 1.9, 1.8, "1", "limit").passed);
  EXPECT_FALSE(within("d", NAN, 1.8, "1", "limit").passed);
  EXPECT_EQ(within("d", 1.0, 1.8, "1", "limit").reference, 1.8);
}

TEST(Figure, APublishedValueBesideOursIsSeenToBeNotAsserted) {
  const Row row = beside("falls", 3.0, 7.0, "1", "another robot's");
  EXPECT_TRUE(row.passed);
  EXPECT_EQ(row.reference, 7.0);
  EXPECT_TRUE(std::isnan(row.tolerance));
  EXPECT_EQ(row.why, "not asserted: another robot's");
  EXPECT_FALSE(beside("falls", NAN, 7.0, "1", "").passed) << "what never came about is no value";
}

TEST(Figure, AnEmptyReportHasNotPassed) {
  EXPECT_FALSE(Report{}.passed());
  EXPECT_TRUE((Report{.rows = {holds("a", true)}, .plots = {}}.passed()));
  EXPECT_FALSE((Report{.rows = {holds("a", true), holds("b", false)}, .plots = {}}.passed()));
}

}  // namespace
}  // namespace mimesis::reproduce
