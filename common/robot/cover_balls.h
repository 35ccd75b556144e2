#pragma once
#include <memory>
#include <span>
#include <vector>

#include "common/robot/triangle_mesh.h"

namespace mimesis::robot {

/// A solid that a link is made of, in the link's frame L.
struct Solid {
  enum class Kind { box, ball, cylinder, mesh } kind = Kind::box;
  Eigen::Isometry3d X_LS = Eigen::Isometry3d::Identity();  ///< its middle, or the mesh's frame
  /// Half edges of a box; radius of a ball, in x; radius in x and half length, along z, in z of a
  /// cylinder [m]
  Eigen::Vector3d half_m = Eigen::Vector3d::Zero();
  std::shared_ptr<const TriangleMesh> mesh{};  ///< in S
};

/// Distance of p from the union of solids; below 0 inside, where p may be deeper than it says in
/// more than one of them. An open mesh is inside where its triangles go round p by more than half.
double signed_distance(std::span<const Solid> solids, const Eigen::Vector3d& p_L);

struct CoverBall {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< in L [m]
  double radius = 0.0;                               ///< [m]
};

struct CoverSettings {
  double tolerance_m = 0.03;  ///< how far balls may reach out of the solids
  int most_balls = 16;        ///< where that takes more, they reach out farther
};

/// Balls that cover every point of the solids, boundary and inside. Same input, same bits.
///
/// A ball at c of radius tolerance − signed_distance(c) reaches out by the tolerance at most: these
/// are the candidates, c on a grid near the medial axis. The fewest that cover sample points are
/// sought greedily, moved and shrunk to the points that are theirs; then cubes, divided down to
/// tolerance/32, prove that nothing is left, or balls grow until nothing is.
std::vector<CoverBall> cover_balls(std::span<const Solid> solids, const CoverSettings& settings);

/// How much more than the solids the balls are.
struct OverCoverage {
  double reach_m = 0.0;   ///< bound of the largest distance of a ball's surface from the solids
  double solid_m3 = 0.0;  ///< volume of the union; this and the others by 2¹⁶ points
  double balls_m3 = 0.0;
  double bare_m3 = 0.0;  ///< of the solids, in no ball
};
OverCoverage over_coverage(std::span<const Solid> solids, std::span<const CoverBall> balls);

}  // namespace mimesis::robot
