#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "experiments/harness/figure.h"

namespace mimesis::reproduce {

/// Runs a figure without plots: there are rows, and all hold.
inline void expect_rows_hold(const Figure& figure) {
  const Report report = figure.run(std::nullopt);
  EXPECT_FALSE(report.rows.empty());
  EXPECT_TRUE(report.plots.empty());
  for (const Row& row : report.rows) {
    EXPECT_TRUE(row.passed) << figure.name << ": " << row.what << ": " << row.ours << ' '
                            << row.unit << ", expected " << row.reference.value;
  }
}

/// Those of `all` that are among `slow`, or the others.
inline std::vector<Figure> chosen(std::vector<Figure> all, const std::set<std::string>& slow,
                                  bool are_slow) {
  std::erase_if(all, [&](const Figure& f) { return slow.contains(f.name) != are_slow; });
  return all;
}

/// Name of the test of a figure: "fig_2_4".
inline std::string test_name(const ::testing::TestParamInfo<Figure>& info) {
  std::string name = info.param.name;
  std::ranges::replace_if(
      name, [](char c) { return c == '-' || c == '.'; }, '_');
  return name;
}

}  // namespace mimesis::reproduce
