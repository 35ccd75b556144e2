#pragma once
#include <vector>

#include "experiments/harness/figure.h"

namespace mimesis::walker {

/// Figures of M18 section 3.8 that need the walker alone.
std::vector<reproduce::Figure> figures();

// Parts of the list, one per file.
void add_filter_figure(std::vector<reproduce::Figure>& to);  // 3.43

}  // namespace mimesis::walker
