#pragma once
#include <vector>

#include "nodes/walker/pattern/footsteps.h"

namespace mimesis::walker {

/// Sides of the convex hull of the rectangles with half sizes `half_m` about two feet, n · z ≤ b,
/// at most 8. Replaces what is in `sides`; does not allocate if that has room for 8.
void support_polygon(const Footprint& a, const Footprint& b, const Eigen::Vector2d& half_m,
                     std::vector<HalfPlane>& sides);

}  // namespace mimesis::walker
