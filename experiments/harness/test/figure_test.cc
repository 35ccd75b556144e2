#include "experiments/harness/figure.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mimesis::reproduce {
namespace {

TEST(Figure, RowsJudgeThemselves) {
  EXPECT_TRUE(near("a", 1.05, goal(1.0), 0.1, "ms").passed);
  EXPECT_FALSE(near("a", 1.15, goal(1.0), 0.1, "ms").passed);
  EXPECT_FALSE(near("a", NAN, goal(1.0), 0.1, "ms").passed);
  EXPECT_TRUE(holds("b", true, goal()).passed);
  EXPECT_FALSE(holds("b", false, goal()).passed);
  EXPECT_TRUE(at_least("c", 1.8, 1.8, "1", "bound").passed);
  EXPECT_FALSE(at_least("c", 1.7, 1.8, "1", "bound").passed);
  EXPECT_FALSE(at_least("c", NAN, 1.8, "1", "bound").passed);
  EXPECT_TRUE(at_most("d", 1.8, 1.8, "1", "bound").passed);
  EXPECT_FALSE(at_most("d", 1.9, 1.8, "1", "bound").passed);
  EXPECT_FALSE(at_most("d", NAN, 1.8, "1", "bound").passed);
}

TEST(Figure, RowsSayWhoseNumberStandsBesideOurs) {
  const Row printed = at_most("d", 1.0, published(1.8, "M18 fig. 3.41"), "1", "bound");
  EXPECT_EQ(printed.reference.value, 1.8);
  EXPECT_EQ(printed.reference.origin, Origin::published);
  EXPECT_EQ(printed.reference.where, "M18 fig. 3.41");
  EXPECT_EQ(at_most("d", 1.0, 1.8, "1", "bound").reference.origin, Origin::goal);
  EXPECT_EQ(near("a", 1.0, prototype(1.0, "fields.md"), 0.1, "1").reference.origin,
            Origin::prototype);
  EXPECT_EQ(holds("b", true, closed_form("eq. 2.3")).reference.origin, Origin::closed_form);
}

TEST(Figure, AValueBesideOursIsSeenToBeNotAsserted) {
  const Row row = beside("falls", 3.0, published(7.0, "M18 table 3.1"), "1", "another robot's");
  EXPECT_TRUE(row.passed);
  EXPECT_EQ(row.reference.value, 7.0);
  EXPECT_TRUE(std::isnan(row.tolerance));
  EXPECT_EQ(row.why, "not asserted: another robot's");
  EXPECT_FALSE(beside("falls", NAN, goal(7.0), "1", "").passed) << "never came about";
}

TEST(Figure, AnEmptyReportHasNotPassed) {
  EXPECT_FALSE(Report{}.passed());
  EXPECT_TRUE((Report{.rows = {holds("a", true, goal())}, .plots = {}}.passed()));
  EXPECT_FALSE((
      Report{.rows = {holds("a", true, goal()), holds("b", false, goal())}, .plots = {}}.passed()));
}

TEST(Figure, FailsIfItsRowsAreOthersThanDeclared) {
  Figure figure{"fig", "title", "M18", {.published = 1, .goal = 1}, [](const auto&) {
                  return Report{.rows = {holds("a", true, published("M18 2.4.1")),
                                         at_most("b", 1.0, 2.0, "1", "bound")},
                                .plots = {}};
                }};
  EXPECT_TRUE(figure.run({}).passed());
  EXPECT_EQ(figure.run({}).rows.size(), 2U);
  figure.rows = {.closed_form = 1, .goal = 1};
  const Report report = figure.run({});
  EXPECT_FALSE(report.passed());
  ASSERT_EQ(report.rows.size(), 3U);
  EXPECT_EQ(report.rows.back().what, "rows as declared");
  EXPECT_EQ(report.rows.back().why,
            "declared are 1 closed form, 1 goal; found were 1 published, 1 goal");
}

}  // namespace
}  // namespace mimesis::reproduce
