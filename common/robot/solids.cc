#include "common/robot/solids.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/error.h"

namespace mimesis::robot {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

/// Distance from a box around the origin, in as many dimensions as q has: q = |p| − half.
template <class Vector>
double from_box(const Vector& q) {
  return q.maxCoeff() < 0.0 ? q.maxCoeff() : q.cwiseMax(0.0).norm();
}

double signed_distance(const Solid& solid, const Vector3d& p_L) {
  const Vector3d p = solid.X_LS.inverse(Eigen::Isometry) * p_L;
  switch (solid.kind) {
    case Solid::Kind::box:
      return from_box(Vector3d(p.cwiseAbs() - solid.half_m));
    case Solid::Kind::ball:
      return p.norm() - solid.half_m.x();
    case Solid::Kind::cylinder:
      return from_box(Eigen::Vector2d(p.head<2>().norm() - solid.half_m.x(),
                                      std::abs(p.z()) - solid.half_m.z()));
    case Solid::Kind::mesh:
      break;
  }
  const double distance = solid.mesh->distance(p);
  const bool inside = solid.mesh->box().contains(p) && std::abs(solid.mesh->winding(p)) > 0.5;
  return inside ? -distance : distance;
}

}  // namespace

double signed_distance(std::span<const Solid> solids, const Vector3d& p_L) {
  double least = std::numeric_limits<double>::infinity();
  for (const Solid& solid : solids) least = std::min(least, signed_distance(solid, p_L));
  return least;
}

AlignedBox3d box_of(std::span<const Solid> solids) {
  AlignedBox3d box;
  for (const Solid& solid : solids) {
    AlignedBox3d own(-solid.half_m, solid.half_m);
    if (solid.kind == Solid::Kind::ball)
      own = {Vector3d::Constant(-solid.half_m.x()), Vector3d::Constant(solid.half_m.x())};
    if (solid.kind == Solid::Kind::cylinder)
      own = {Vector3d(-solid.half_m.x(), -solid.half_m.x(), -solid.half_m.z()),
             Vector3d(solid.half_m.x(), solid.half_m.x(), solid.half_m.z())};
    if (solid.kind == Solid::Kind::mesh) own = solid.mesh->box();
    box.extend(own.transformed(solid.X_LS));
  }
  return box;
}

namespace {

using Eigen::Vector3d;
using Triangle = TriangleMesh::Triangle;

Vector3d middle_of(const Triangle& t) { return (t[0] + t[1] + t[2]) / 3.0; }
Vector3d area_of(const Triangle& t) { return 0.5 * (t[1] - t[0]).cross(t[2] - t[0]); }

double to_edge(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d along = b - a;
  const double length2 = along.squaredNorm();
  const double share = length2 > 0.0 ? std::clamp((p - a).dot(along) / length2, 0.0, 1.0) : 0.0;
  return (p - a - share * along).norm();
}

double to_triangle(const Vector3d& p, const Triangle& t) {
  const Vector3d n = area_of(t);
  bool above = n.squaredNorm() > 0.0;  // the foot of p is between all edges
  for (std::size_t i = 0; above && i < 3; ++i)
    above = n.cross(t[(i + 1) % 3] - t[i]).dot(p - t[i]) >= 0.0;
  if (above) return std::abs((p - t[0]).dot(n.normalized()));
  return std::min({to_edge(p, t[0], t[1]), to_edge(p, t[1], t[2]), to_edge(p, t[2], t[0])});
}

/// Solid angle under which p sees the triangle, over 4π (van Oosterom and Strackee 1983).
double turns(const Vector3d& p, const Triangle& t) {
  const Vector3d a = t[0] - p, b = t[1] - p, c = t[2] - p;
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return std::atan2(a.dot(b.cross(c)),
                    la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb) /
         (2.0 * std::numbers::pi);
}

}  // namespace

TriangleMesh::TriangleMesh(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
  if (triangles_.empty()) throw ConfigError("has no triangles");
  for (const Triangle& t : triangles_) {
    for (const Vector3d& p : t)
      if (!p.allFinite()) throw ConfigError("has a coordinate that is not finite");
  }
  build(0, triangles_.size());
}

std::size_t TriangleMesh::build(std::size_t begin, std::size_t end) {
  constexpr std::size_t kLeaf = 4;
  const std::size_t index = nodes_.size();
  Node node;
  node.begin = begin;
  node.end = end;
  double weight = 0.0;
  for (std::size_t i = begin; i < end; ++i) {
    for (const Vector3d& p : triangles_[i]) node.box.extend(p);
    const Vector3d area = area_of(triangles_[i]);
    node.area += area;
    node.middle += area.norm() * middle_of(triangles_[i]);
    weight += area.norm();
  }
  node.middle = weight > 0.0 ? Vector3d(node.middle / weight) : node.box.center();
  for (std::size_t i = begin; i < end; ++i) {
    for (const Vector3d& p : triangles_[i])
      node.reach = std::max(node.reach, (p - node.middle).norm());
  }
  nodes_.push_back(node);
  if (end - begin <= kLeaf) return index;
  Eigen::Index axis = 0;
  node.box.sizes().maxCoeff(&axis);
  const std::size_t half = begin + (end - begin) / 2;
  const auto at = [this](std::size_t i) {
    return triangles_.begin() + static_cast<std::ptrdiff_t>(i);
  };
  std::nth_element(at(begin), at(half), at(end), [axis](const Triangle& a, const Triangle& b) {
    return middle_of(a)[axis] < middle_of(b)[axis];
  });
  build(begin, half);
  const std::size_t right = build(half, end);
  nodes_[index].right = right;
  return index;
}

double TriangleMesh::distance(const Vector3d& p) const {
  double best = std::numeric_limits<double>::infinity();
  std::array<std::size_t, 64> open{};  // a median tree of 2⁶⁰ triangles is no deeper
  std::size_t count = 1;
  while (count > 0) {
    const Node& node = nodes_[open[--count]];
    if (node.box.exteriorDistance(p) >= best) continue;
    if (node.right == 0) {
      for (std::size_t i = node.begin; i < node.end; ++i)
        best = std::min(best, to_triangle(p, triangles_[i]));
      continue;
    }
    const auto left = static_cast<std::size_t>(&node - nodes_.data()) + 1;
    const bool right_first = nodes_[node.right].box.squaredExteriorDistance(p) <
                             nodes_[left].box.squaredExteriorDistance(p);
    open[count++] = right_first ? left : node.right;
    open[count++] = right_first ? node.right : left;
  }
  return best;
}

double TriangleMesh::winding(const Vector3d& p) const {
  constexpr double kFar = 2.0;  // times the reach of a dipole
  double sum = 0.0;
  std::array<std::size_t, 64> open{};
  std::size_t count = 1;
  while (count > 0) {
    const Node& node = nodes_[open[--count]];
    const Vector3d to = node.middle - p;
    const double distance = to.norm();
    if (distance > kFar * node.reach && distance > 0.0) {
      sum += to.dot(node.area) / (4.0 * std::numbers::pi * distance * distance * distance);
    } else if (node.right == 0) {
      for (std::size_t i = node.begin; i < node.end; ++i) sum += turns(p, triangles_[i]);
    } else {
      open[count++] = node.right;
      open[count++] = static_cast<std::size_t>(&node - nodes_.data()) + 1;
    }
  }
  return sum;
}

}  // namespace mimesis::robot
