#pragma once
#include <vector>

#include "nodes/camera/renderer.h"
#include "nodes/vision/table_watcher.h"

namespace mimesis {

inline constexpr double kFrame = 1.0 / 30.0;  ///< [s]

/// Result of one demonstration.
struct Verdict {
  bool grip = false, transport = false, goal = false, color = false, complete = false;  ///< right
  int abstained = 0;       ///< pictures without a vote for the grip
  int flips = 0;           ///< changes of a decided symbol
  double decided_s = 0.0;  ///< when the grip was known, from the touch of the object on

  bool right() const { return grip && transport && goal && color && complete; }
};

/// Renders a demonstration and watches it from beginning to end.
Verdict watch(const camera::Picture& picture);

/// One of the eight combinations, k = 0..7.
task::Demonstration demonstration(int k);

/// Light and camera.
struct Conditions {
  const char* what;
  double noise, blur_px, gain, warmth, bar_height_m;
  task::Color color;
};
const std::vector<Conditions>& all_conditions();
camera::Picture picture_of(const task::Demonstration& shown, const Conditions& c,
                           std::uint64_t seed);

}  // namespace mimesis
