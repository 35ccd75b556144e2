#pragma once
#include <span>
#include <vector>

#include "common/math/convex_part.h"
#include "common/robot/solids.h"

namespace mimesis::robot {

struct PartSettings {
  double tolerance_m = 0.006;  ///< how far parts may reach out of the solids
  int most_parts = 16;         ///< of a mesh; with more to divide they reach out farther
};

/// Convex parts that hold every point of the solids, boundary and inside, in L. Same input, same
/// bits.
///
/// A mesh is one part; the part that reaches out farthest is cut by a plane, always by that which
/// leaves the least volume, until none reaches out by more than the tolerance. What the plane cuts
/// of surface and inside belongs to both sides, which get their hulls. Corners less than a quarter
/// of the tolerance out of the others' hull are left out, and the part is as much rounder.
std::vector<math::ConvexPart> convex_parts(std::span<const Solid> solids,
                                           const PartSettings& settings);

/// One part that holds parts; their corners that are less than `slack_m` out of it are rounded.
math::ConvexPart hull_around(std::span<const math::ConvexPart> parts, double slack_m);

/// Balls that cover a part: of at most `most` slices of its longest side.
std::vector<math::RoundBound> balls_around(const math::ConvexPart& part, int most = 4);

/// Triangles of a part's hull, counter-clockwise seen from outside, without its radius; none if its
/// points are in one plane.
std::vector<TriangleMesh::Triangle> hull_faces(const math::ConvexPart& part);

/// How much more than the solids parts are, by 2¹³ points and by points on their faces.
struct OverCoverage {
  double reach_m = 0.0;   ///< largest distance of their surface from the solids
  double solid_m3 = 0.0;  ///< volume of the union
  double parts_m3 = 0.0;
  double bare_m3 = 0.0;  ///< of the solids, in no part
};
OverCoverage over_coverage(std::span<const Solid> solids, std::span<const math::ConvexPart> parts);

}  // namespace mimesis::robot
