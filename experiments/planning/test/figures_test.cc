#include "experiments/planning/figures.h"

#include "experiments/harness/test/figure_rows.h"

namespace mimesis::planner {
namespace {

TEST(PlanningFigures, AllPass) {
  for (const reproduce::Figure& figure : figures()) reproduce::expect_rows_hold(figure);
}

}  // namespace
}  // namespace mimesis::planner
