#include "experiments/fields/figures.h"

#include "experiments/harness/test/figure_rows.h"

namespace mimesis::cognition {
namespace {

class Figures : public ::testing::TestWithParam<reproduce::Figure> {};

TEST_P(Figures, EveryRowIsWithinItsTolerance) { reproduce::expect_rows_hold(GetParam()); }

/// Those that take minutes are for `mimesis reproduce`.
std::vector<reproduce::Figure> quick_figures() {
  auto all = figures();
  std::erase_if(all, [](const reproduce::Figure& f) { return f.cpu_minutes >= 1.0; });
  return all;
}

INSTANTIATE_TEST_SUITE_P(Dissertation, Figures, ::testing::ValuesIn(quick_figures()),
                         reproduce::test_name);

}  // namespace
}  // namespace mimesis::cognition
