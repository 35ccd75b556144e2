// All rows of all figures. Figures that take longer than some seconds are the slow suite: ctest
// runs it under the label `slow`, and here --gtest_also_run_disabled_tests --gtest_filter='*Slow*'.
#include "experiments/motion/figures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "common/motion/mocap/test/shared_folder.h"

namespace mimesis::synthesizer {
namespace {

const std::set<std::string> kSlow = {"blending", "demixing", "fig-3.10", "fig-3.11",
                                     "fig-3.13", "fig-3.14", "fig-3.15", "fig-3.20",
                                     "fig-3.31", "fig-3.33", "fig-3.7",  "walk-styles"};
/// Computed from recordings, which are no part of the repository.
const std::set<std::string> kFromRecordings = {"blending", "demixing", "fig-3.10",   "fig-3.11",
                                               "fig-3.31", "fig-3.33", "walk-styles"};

std::vector<std::string> names(bool slow) {
  std::vector<std::string> out;
  for (const reproduce::Figure& figure : figures()) {
    if (kSlow.contains(figure.name) == slow) out.push_back(figure.name);
  }
  return out;
}

class FigureRows : public ::testing::TestWithParam<std::string> {};

TEST_P(FigureRows, Hold) {
  if (kFromRecordings.contains(GetParam()) && !std::filesystem::exists(mocap::shared_mocap())) {
    GTEST_SKIP() << "not here: " << mocap::shared_mocap() << " is absent";
  }
  const auto all = figures();
  const reproduce::Report report =
      std::ranges::find(all, GetParam(), &reproduce::Figure::name)->run(std::nullopt);
  EXPECT_FALSE(report.rows.empty());
  for (const reproduce::Row& row : report.rows) {
    EXPECT_TRUE(row.passed) << row.what << ": " << row.ours << ' ' << row.unit << ", expected "
                            << row.reference.value;
  }
  EXPECT_TRUE(report.plots.empty());
}

std::string as_word(const ::testing::TestParamInfo<std::string>& info) {
  std::string word = info.param;
  std::ranges::replace_if(
      word, [](char c) { return c == '-' || c == '.'; }, '_');
  return word;
}

INSTANTIATE_TEST_SUITE_P(Quick, FigureRows, ::testing::ValuesIn(names(false)), as_word);
INSTANTIATE_TEST_SUITE_P(DISABLED_Slow, FigureRows, ::testing::ValuesIn(names(true)), as_word);

TEST(Figures, HaveNamesOfTheirOwn) {
  std::set<std::string> seen;
  for (const reproduce::Figure& figure : figures()) {
    EXPECT_TRUE(seen.insert(figure.name).second) << figure.name;
    EXPECT_EQ(figure.source, "M18") << figure.name;
    EXPECT_FALSE(figure.title.empty()) << figure.name;
  }
}

}  // namespace
}  // namespace mimesis::synthesizer
