#include "experiments/fields/figures.h"

#include <gtest/gtest.h>

namespace mimesis::cognition {
namespace {

class Figures : public ::testing::TestWithParam<reproduce::Figure> {};

TEST_P(Figures, EveryRowIsWithinItsTolerance) {
  const reproduce::Report report = GetParam().run(std::nullopt);
  EXPECT_GE(report.rows.size(), 5U);
  EXPECT_TRUE(report.plots.empty());
  for (const reproduce::Row& row : report.rows) {
    EXPECT_TRUE(row.passed) << row.what << ": " << row.ours << ' ' << row.unit << ", reference "
                            << row.reference.value;
  }
}

/// Those that take minutes are for `mimesis reproduce`.
std::vector<reproduce::Figure> quick_figures() {
  auto all = figures();
  std::erase_if(all, [](const reproduce::Figure& f) { return f.cpu_minutes >= 1.0; });
  return all;
}

INSTANTIATE_TEST_SUITE_P(Dissertation, Figures, ::testing::ValuesIn(quick_figures()),
                         [](const auto& figure) {
                           std::string name = figure.param.name;
                           for (char& c : name) c = c == '-' || c == '.' ? '_' : c;
                           return name;
                         });

}  // namespace
}  // namespace mimesis::cognition
