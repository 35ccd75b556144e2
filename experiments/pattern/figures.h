#pragma once
#include <vector>

#include "experiments/harness/figure.h"

namespace mimesis::walker {

/// Figures of M18 section 3.8 that need the walker alone.
std::vector<reproduce::Figure> figures();

}  // namespace mimesis::walker
