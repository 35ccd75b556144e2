#pragma once
#include <vector>

#include "experiments/harness/figure.h"

namespace mimesis::vision {

/// Calibration of a real pair, whose pictures are in $MIMESIS_SHARED/vision (or ../shared); reports
/// if they are absent.
reproduce::Figure stereo_calibration_figure();

}  // namespace mimesis::vision

namespace mimesis::sight {

/// Segmentation and places from two cameras on tables that vision was not told.
reproduce::Figure segmentation_figure();

/// Symbols of 200 demonstrations in scenes that vision was not told.
reproduce::Figure symbols_figure();

/// The set-up [M18 fig. 2.3]: what vision tells of the teacher's table, and the robot's eye of its
/// own.
reproduce::Figure setup_figure();

/// What vision is judged by [M18 2.1.1, 2.2.1]: calibration, and the hand tracker against hands,
/// cameras and rooms that it does not know.
std::vector<reproduce::Figure> figures();

}  // namespace mimesis::sight
