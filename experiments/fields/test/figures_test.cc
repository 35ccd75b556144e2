#include "experiments/fields/figures.h"

#include <set>

#include "experiments/harness/test/figure_rows.h"

namespace mimesis::cognition {
namespace {

class Figures : public ::testing::TestWithParam<reproduce::Figure> {};

TEST_P(Figures, EveryRowIsWithinItsTolerance) { reproduce::expect_rows_hold(GetParam()); }

const std::set<std::string> kSlow = {"fields-sensitivity", "fields-task"};

/// Those that take minutes are for `mimesis reproduce`.
std::vector<reproduce::Figure> repeatable() {
  auto all = figures();
  std::erase_if(all, [](const reproduce::Figure& f) { return f.cpu_minutes >= 1.0; });
  return all;
}

INSTANTIATE_TEST_SUITE_P(Dissertation, Figures,
                         ::testing::ValuesIn(reproduce::chosen(repeatable(), kSlow, false)),
                         reproduce::test_name);
INSTANTIATE_TEST_SUITE_P(DISABLED_Slow, Figures,
                         ::testing::ValuesIn(reproduce::chosen(repeatable(), kSlow, true)),
                         reproduce::test_name);

}  // namespace
}  // namespace mimesis::cognition
