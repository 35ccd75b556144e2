#pragma once
#include <vector>

#include "experiments/harness/figure.h"

namespace mimesis::vision {

/// Calibration of a real pair, whose pictures are in $MIMESIS_SHARED/vision (or ../shared); reports
/// if they are absent.
reproduce::Figure stereo_calibration_figure();

}  // namespace mimesis::vision

namespace mimesis::sight {

/// What vision is judged by [M18 2.1.1, 2.2.1]: calibration, and the hand tracker against hands,
/// cameras and rooms that it does not know.
std::vector<reproduce::Figure> figures();

}  // namespace mimesis::sight
