#include "experiments/pattern/figures.h"

#include <gtest/gtest.h>

namespace mimesis::walker {
namespace {

TEST(WalkerFigures, AllRowsHold) {
  for (const reproduce::Figure& figure : figures()) {
    const reproduce::Report report = figure.run(std::nullopt);
    EXPECT_FALSE(report.rows.empty());
    for (const reproduce::Row& row : report.rows) {
      EXPECT_TRUE(row.passed) << figure.name << ": " << row.what << ": " << row.ours << ' '
                              << row.unit << ", reference " << row.reference.value;
    }
  }
}

}  // namespace
}  // namespace mimesis::walker
