#pragma once
#include <vector>

#include "nodes/synthesizer/walkers.h"

namespace mimesis::synthesizer {

enum class Arrangement { row, circle, grid };

/// Where characters stand at the start.
struct Formation {
  Arrangement arrangement = Arrangement::grid;
  double spacing_m = 1.2;  ///< between neighbours
  Eigen::Vector2d centre_W_m = Eigen::Vector2d::Zero();
  double heading_rad = 0.0;
  bool spread_phases = false;  ///< else all begin at phase 0
};

/// Row: side by side, across the heading. Circle: facing the centre. Grid: rows of ⌈√count⌉, one
/// behind the other. Spread phases are multiples of the golden section of a cycle: even, and
/// neighbours differ.
std::vector<WalkerStart> form(int count, const Formation& formation);

}  // namespace mimesis::synthesizer
