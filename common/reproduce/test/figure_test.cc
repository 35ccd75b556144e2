#include "common/reproduce/figure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "common/reproduce/gnuplot.h"

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

TEST(Gnuplot, QuotesLabels) { EXPECT_EQ(quoted("it's"), "'it''s'"); }

TEST(Gnuplot, SaysWhatItCannotDo) {
  const auto message = [](const std::filesystem::path& png, const std::string& script) {
    try {
      plot_png(png, 100, 100, {}, script);
    } catch (const std::runtime_error& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  const std::string bad =
      message(std::filesystem::temp_directory_path() / "x.png", "plot nonsense(");
  EXPECT_TRUE(bad.starts_with("plot: gnuplot")) << bad;  // absent, or fails on the script
  const std::string nowhere = message("/proc/none/x.png", "plot sin(x)");
  EXPECT_TRUE(nowhere.starts_with("plot: ")) << nowhere;
}

}  // namespace
}  // namespace mimesis::reproduce
