#pragma once
#include <vector>

#include "experiments/harness/figure.h"

namespace mimesis::planner {

/// Path planning [M18 2.3.2, figures 2.6 to 2.16].
std::vector<reproduce::Figure> figures();
/// Those of arms at the bar: figures 2.6, 2.8, 2.15, 2.16.
std::vector<reproduce::Figure> bar_figures();

}  // namespace mimesis::planner
