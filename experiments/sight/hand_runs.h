#pragma once
#include <vector>

#include "experiments/sight/truth/hand_world.h"

namespace mimesis::sight {

/// One run of the hand tracker in a world that it does not know.
struct HandTrial {
  truth::HandWorldSetup world;
  int frames = 200;
  double start_off_m = 0.04;       ///< distance of the first guess from the truth
  double start_turn_rad = 0.5236;  ///< rotation between them
  double length_error = 0.0;       ///< of the length that the tracker is told, relative [1]
};

/// Errors of every frame. Position across and along the first camera's axis.
struct HandCourse {
  std::vector<double> across_m, along_m, turn_rad, tips_m;
  std::vector<bool> found;
  double length_ratio = 1.0;  ///< length estimated last over the true one [1]

  /// Frames whose pose has nothing to do with the hand: 40 mm or 60° off.
  int lost() const;
  /// The pose is right at a frame: within 25 mm and 35°.
  bool right(int frame) const;
};

/// Quantile of values, 0.5: median.
double quantile(std::vector<double> values, double share);

/// Runs the tracker.
HandCourse track_hand(const HandTrial& trial);

// What must fail where the tracker works.
/// The pose at the start, for ever.
HandCourse freeze_hand(const HandTrial& trial);
/// The centroid of skin colour at the depth and with the orientation of the start.
HandCourse follow_blob(const HandTrial& trial);
/// Same model and optimiser, but the mutual information of every picture on its own: label (hand or
/// not) and chroma within a window around the last pose, from a histogram of the candidate's own
/// labels. One camera.
HandCourse track_by_free_histogram(const HandTrial& trial);

}  // namespace mimesis::sight
