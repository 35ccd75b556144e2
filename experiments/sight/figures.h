#pragma once
#include <vector>

#include "experiments/harness/figure.h"

namespace mimesis::sight {

/// hand-mono and hand-stereo: the hand tracker [M18 2.2.1] against hands, cameras and rooms that it
/// does not know.
std::vector<reproduce::Figure> figures();

}  // namespace mimesis::sight
