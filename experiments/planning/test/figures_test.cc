#include "experiments/planning/figures.h"

#include <gtest/gtest.h>

namespace mimesis::planner {
namespace {

TEST(PlanningFigures, AllPass) {
  for (const reproduce::Figure& figure : figures()) {
    for (const reproduce::Row& row : figure.run(std::nullopt).rows) {
      EXPECT_TRUE(row.passed) << figure.name << ": " << row.what << ": " << row.ours
                              << ", expected " << row.reference.value;
    }
  }
}

}  // namespace
}  // namespace mimesis::planner
