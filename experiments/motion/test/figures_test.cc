// All rows of all figures. Figures that take longer than some seconds are the slow suite: ctest
// runs it under the label `slow`, and here --gtest_also_run_disabled_tests --gtest_filter='*Slow*'.
#include "experiments/motion/figures.h"

#include <set>

#include "common/motion/mocap/test/shared_folder.h"
#include "experiments/harness/test/figure_rows.h"

namespace mimesis::synthesizer {
namespace {

const std::set<std::string> kSlow = {"blending", "demixing", "fig-3.10", "fig-3.11",
                                     "fig-3.13", "fig-3.14", "fig-3.15", "fig-3.20",
                                     "fig-3.31", "fig-3.33", "fig-3.7",  "walk-styles"};
/// Computed from recordings, which are no part of the repository.
const std::set<std::string> kFromRecordings = {"blending", "demixing", "fig-3.10",   "fig-3.11",
                                               "fig-3.31", "fig-3.33", "walk-styles"};

class FigureRows : public ::testing::TestWithParam<reproduce::Figure> {};

TEST_P(FigureRows, Hold) {
  if (kFromRecordings.contains(GetParam().name) &&
      !std::filesystem::exists(mocap::shared_mocap())) {
    GTEST_SKIP() << "not here: " << mocap::shared_mocap() << " is absent";
  }
  reproduce::expect_rows_hold(GetParam());
}

INSTANTIATE_TEST_SUITE_P(Quick, FigureRows,
                         ::testing::ValuesIn(reproduce::chosen(figures(), kSlow, false)),
                         reproduce::test_name);
INSTANTIATE_TEST_SUITE_P(DISABLED_Slow, FigureRows,
                         ::testing::ValuesIn(reproduce::chosen(figures(), kSlow, true)),
                         reproduce::test_name);

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
