#include "experiments/fields/figures.h"

#include <gtest/gtest.h>

#include <set>

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

const std::set<std::string> kSlow = {"fields-sensitivity", "fields-task"};

/// Those that take minutes are for `mimesis reproduce`.
std::vector<reproduce::Figure> chosen(bool slow) {
  auto all = figures();
  std::erase_if(all, [slow](const reproduce::Figure& f) {
    return f.cpu_minutes >= 1.0 || kSlow.contains(f.name) != slow;
  });
  return all;
}
std::string as_word(const ::testing::TestParamInfo<reproduce::Figure>& figure) {
  std::string name = figure.param.name;
  for (char& c : name) c = c == '-' || c == '.' ? '_' : c;
  return name;
}

INSTANTIATE_TEST_SUITE_P(Dissertation, Figures, ::testing::ValuesIn(chosen(false)), as_word);
INSTANTIATE_TEST_SUITE_P(DISABLED_Slow, Figures, ::testing::ValuesIn(chosen(true)), as_word);

}  // namespace
}  // namespace mimesis::cognition
