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

vision::Grip expected(camera::Grip grip);

/// One of the eight combinations, k = 0..7.
camera::Lesson lesson(int k);

/// Light and camera.
struct Conditions {
  const char* what;
  double noise, blur_px, gain, warmth, bridge_height_m;
  camera::Color color;
};
const std::vector<Conditions>& all_conditions();
camera::Picture picture_of(const camera::Lesson& lesson, const Conditions& c, std::uint64_t seed);

}  // namespace mimesis
