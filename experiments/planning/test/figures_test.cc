#include "experiments/planning/figures.h"

#include <gtest/gtest.h>

namespace mimesis::planner {
namespace {

TEST(PlanningFigures, AllPass) {
  for (const reproduce::Figure& figure : figures()) {
    const reproduce::Report report = figure.run(std::nullopt);
    for (const reproduce::Row& row : report.rows) {
      EXPECT_TRUE(row.passed) << figure.name << ": " << row.what << ": " << row.ours
                              << ", expected " << row.reference.value;
    }
  }
}

}  // namespace
}  // namespace mimesis::planner
