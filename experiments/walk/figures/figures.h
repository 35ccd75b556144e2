#pragma once
#include <vector>

#include "experiments/harness/figure.h"

namespace mimesis::walk {

/// Figures and tables of walking that need the physics: M18 3.8 and the paths of 4.5.1. In a build
/// without DART they are listed and say so when they are asked for.
std::vector<reproduce::Figure> figures();

}  // namespace mimesis::walk
