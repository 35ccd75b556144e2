#pragma once
#include "nodes/crowd/engine/lanes.h"

namespace mimesis::crowd::rows {

constexpr int kBlock = 64;  // rows at a time: what is computed of them stays in the first cache
using Column = double[kBlock];

/// What one step adds, and directions after it. Of the rows at hand: nothing else is set.
struct Step {
  Column phase, heading, way, way_x, way_y;
  Column cos_phase, sin_phase, cos_heading, sin_heading;
};

/// The second of Adams and Bashforth; while there is no rate of the step before, Euler's.
MIMESIS_PART double increment(double dt, double now, double before) {
  return dt * (1.5 * now - 0.5 * (before == before ? before : now));
}

}  // namespace mimesis::crowd::rows
