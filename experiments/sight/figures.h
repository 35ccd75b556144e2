#pragma once
#include <vector>

#include "experiments/harness/figure.h"

namespace mimesis::vision {

/// What vision is judged by. Real pictures are in $MIMESIS_SHARED/vision (or ../shared); a figure
/// reports if they are absent.
std::vector<reproduce::Figure> figures();

}  // namespace mimesis::vision
