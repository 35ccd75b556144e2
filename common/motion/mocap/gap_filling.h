#pragma once
#include <span>
#include <string>
#include <vector>

#include "common/motion/mocap/joint_centres.h"

namespace mimesis::mocap {

/// What became of the gaps in marker trajectories. Counts are of marker frames.
struct GapReport {
  long by_group = 0, by_spline = 0, left = 0;
  std::vector<std::string> notes;  ///< one line each: markers never seen, groups without geometry
};

/// Fills missing (NaN) marker positions in place. A marker of a group of which three others are
/// seen is put where the group's nominal geometry says [M18 3.3.2]; the deviation of its own
/// positions from there at the ends of the gap fades linearly through it, so that nothing jumps.
/// What remains and is no longer than `longest_s` is bridged by a natural cubic spline through the
/// marker's own positions. Longer gaps, and those at the ends of the recording, stay NaN.
GapReport fill_gaps(Markers& markers, std::span<const MarkerGroup> groups, double longest_s = 0.3);

}  // namespace mimesis::mocap
