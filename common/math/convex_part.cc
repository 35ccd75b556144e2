#include "common/math/convex_part.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

#include "common/math/vector_clones.h"

namespace mimesis::math {
namespace {

using Eigen::Vector3d;

constexpr Eigen::Index kWide = 4;
using Wide = double __attribute__((vector_size(8 * kWide)));
using WideIndex = std::int64_t __attribute__((vector_size(8 * kWide)));

/// Row of the point that is farthest along a direction.
MIMESIS_VECTOR_CLONES
Eigen::Index farthest(const Eigen::MatrixX3d& points, const Vector3d& along) {
  const double *x = points.col(0).data(), *y = points.col(1).data(), *z = points.col(2).data();
  const double ax = along.x(), ay = along.y(), az = along.z();
  const Eigen::Index n = points.rows();
  Eigen::Index row = 0;
  double best = -std::numeric_limits<double>::infinity();
  if (n >= kWide) {
    Wide most = best - Wide{};
    WideIndex at{}, index{0, 1, 2, 3};
    for (Eigen::Index i = 0; i + kWide <= n; i += kWide, index += kWide) {
      Wide xs, ys, zs;
      std::memcpy(&xs, x + i, sizeof xs);
      std::memcpy(&ys, y + i, sizeof ys);
      std::memcpy(&zs, z + i, sizeof zs);
      const Wide d = ax * xs + ay * ys + az * zs;
      const WideIndex more = d > most;
      most = more ? d : most;
      at = more ? index : at;
    }
    for (int lane = 0; lane < kWide; ++lane) {
      if (most[lane] <= best) continue;
      best = most[lane];
      row = at[lane];
    }
  }
  for (Eigen::Index i = n - n % kWide; i < n; ++i) {
    const double d = ax * x[i] + ay * y[i] + az * z[i];
    if (d <= best) continue;
    best = d;
    row = i;
  }
  return row;
}

/// Up to four points of the difference of the hulls.
struct Simplex {
  std::array<Vector3d, 4> p;
  std::size_t count = 0;
};

/// Each of these takes away the points that the nearest one does not need. Ericson, Real-Time
/// Collision Detection, 2005, section 5.1.
Vector3d nearest_on_edge(Simplex& s) {
  const Vector3d along = s.p[1] - s.p[0];
  const double length2 = along.squaredNorm(), t = -s.p[0].dot(along);
  if (t <= 0.0 || length2 == 0.0) {
    s.count = 1;
  } else if (t >= length2) {
    s = {{s.p[1]}, 1};
  } else {
    return s.p[0] + t / length2 * along;
  }
  return s.p[0];
}

Vector3d nearest_on_triangle(Simplex& s) {
  const auto [a, b, c, unused] = s.p;
  const Vector3d ab = b - a, ac = c - a;
  const auto on_edge = [&s](const Vector3d& p, const Vector3d& q) {
    s = {{p, q}, 2};
    return nearest_on_edge(s);
  };
  const double d1 = -ab.dot(a), d2 = -ac.dot(a), d3 = -ab.dot(b), d4 = -ac.dot(b), d5 = -ab.dot(c),
               d6 = -ac.dot(c);
  const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  if (va > 0.0 && vb > 0.0 && vc > 0.0) {
    const double all = va + vb + vc;
    return a + vb / all * ab + vc / all * ac;
  }
  // On one of the edges: with flat triangles any of the three may be it.
  Simplex best;
  Vector3d nearest;
  for (const auto& [p, q] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
    const Vector3d there = on_edge(p, q);
    if (best.count > 0 && there.squaredNorm() >= nearest.squaredNorm()) continue;
    nearest = there;
    best = s;
  }
  s = best;
  return nearest;
}

Vector3d nearest_on_tetrahedron(Simplex& s) {
  constexpr std::array<std::array<std::size_t, 4>, 4> kFaces{
      {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}}};
  Simplex best;
  Vector3d nearest = Vector3d::Zero();
  for (const auto& [i, j, k, top] : kFaces) {
    const Vector3d normal = (s.p[j] - s.p[i]).cross(s.p[k] - s.p[i]);
    if (normal.dot(-s.p[i]) * normal.dot(s.p[top] - s.p[i]) > 0.0) continue;
    Simplex face{{s.p[i], s.p[j], s.p[k]}, 3};
    const Vector3d there = nearest_on_triangle(face);
    if (best.count > 0 && there.squaredNorm() >= nearest.squaredNorm()) continue;
    nearest = there;
    best = face;
  }
  if (best.count > 0) s = best;
  return nearest;  // none: the origin is inside
}

Vector3d nearest_to_origin(Simplex& s) {
  switch (s.count) {
    case 1:
      return s.p[0];
    case 2:
      return nearest_on_edge(s);
    case 3:
      return nearest_on_triangle(s);
    default:
      return nearest_on_tetrahedron(s);
  }
}

/// Until `enough(gap)`.
template <class Enough>
Gap search(const ConvexPart& a, const ConvexPart& b, const Eigen::Isometry3d& X_AB,
           Vector3d& from_b, const Enough& enough) {
  constexpr double kMeets = 1e-9, kExact = 1e-6;  // [m]
  constexpr int kMost = 64;
  const double radii = a.radius + b.radius;
  const Eigen::Matrix3d R = X_AB.linear();
  const Vector3d t = X_AB.translation();
  const auto difference = [&](const Vector3d& toward_b) -> Vector3d {
    return a.points.row(farthest(a.points, toward_b)).transpose() - t -
           R * b.points.row(farthest(b.points, -(R.transpose() * toward_b))).transpose();
  };
  Gap gap;
  Simplex simplex;
  if (from_b.isZero(0.0))
    from_b = a.points.row(0).transpose() - t - R * b.points.row(0).transpose();
  if (from_b.isZero(0.0)) from_b = Vector3d::UnitX();
  Vector3d v = difference(-from_b);
  gap.at_least = v.dot(from_b) / from_b.norm() - radii;
  for (int i = 0; i < kMost; ++i) {
    const double length = v.norm();
    gap.at_most = std::min(gap.at_most, length - radii);
    if (length < kMeets) gap.at_least = -radii;
    if (length < kMeets || enough(gap)) return gap;
    from_b = v;
    const Vector3d w = difference(-v);
    gap.at_least = std::max(gap.at_least, v.dot(w) / length - radii);
    const auto end = simplex.p.begin() + static_cast<std::ptrdiff_t>(simplex.count);
    if (enough(gap) || gap.at_most - gap.at_least < kExact ||
        std::find(simplex.p.begin(), end, w) != end)  // no better in double precision
      return gap;
    simplex.p[simplex.count++] = w;
    v = nearest_to_origin(simplex);
  }
  return gap;
}

}  // namespace

RoundBound round_bound(const ConvexPart& part) {
  const Eigen::RowVector3d center =
      0.5 * (part.points.colwise().minCoeff() + part.points.colwise().maxCoeff());
  const double reach = (part.points.rowwise() - center).rowwise().norm().maxCoeff();
  return {center.transpose(), reach + part.radius};
}

Gap gap_between(const ConvexPart& a, const ConvexPart& b, const Eigen::Isometry3d& X_AB,
                double near, double far, Vector3d& from_b) {
  return search(a, b, X_AB, from_b, [&](const Gap& gap) {
    return gap.at_most < near || gap.at_least >= far || (gap.at_least >= near && gap.at_most < far);
  });
}

Gap gap_between(const ConvexPart& a, const ConvexPart& b, const Eigen::Isometry3d& X_AB,
                double near, double far) {
  Vector3d from_b = Vector3d::Zero();
  return gap_between(a, b, X_AB, near, far, from_b);
}

Gap gap_between(const ConvexPart& a, const ConvexPart& b, const Eigen::Isometry3d& X_AB) {
  Vector3d from_b = Vector3d::Zero();
  return search(a, b, X_AB, from_b, [](const Gap&) { return false; });
}

}  // namespace mimesis::math
