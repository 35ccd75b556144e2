#include "common/robot/convex_parts.h"

#include <libqhull_r/qhull_ra.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <optional>
#include <queue>
#include <tuple>

#include "common/error.h"

namespace mimesis::robot {
namespace {

using Eigen::Vector3d;
using math::ConvexPart;
using Triangle = TriangleMesh::Triangle;

Eigen::MatrixX3d rows_of(std::span<const Vector3d> points) {
  Eigen::MatrixX3d rows(std::ssize(points), 3);
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    rows.row(i) = points[static_cast<std::size_t>(i)].transpose();
  return rows;
}

/// Triangles of the hull of points and its volume; nothing if they are in one plane.
struct Hull {
  std::vector<Triangle> faces;
  std::vector<Vector3d> corners;
  double volume = 0.0;
};
std::optional<Hull> hull_of(const std::vector<Vector3d>& points) {
  if (points.size() < 4) return std::nullopt;
  qhT state;
  qh_zero(&state, nullptr);
  std::vector<double> flat;
  flat.reserve(3 * points.size());
  for (const Vector3d& p : points) flat.insert(flat.end(), p.begin(), p.end());
  std::string command = "qhull Qt Pp";
  const std::unique_ptr<FILE, int (*)(FILE*)> silence(std::fopen("/dev/null", "w"), std::fclose);
  const int failed = qh_new_qhull(&state, 3, static_cast<int>(points.size()), flat.data(), False,
                                  command.data(), nullptr, silence.get());
  std::optional<Hull> hull;
  if (failed == 0) {
    qhT* qh = &state;  // the name that qhull's macros use
    hull.emplace();
    facetT* facet = nullptr;
    vertexT *vertex = nullptr, **vertexp = nullptr;
    FORALLfacets {
      if (!facet->simplicial) continue;
      Triangle face;
      std::size_t corner = 0;
      FOREACHvertex_(facet->vertices) {
        if (corner < 3) face[corner++] = Vector3d::Map(vertex->point);
      }
      hull->faces.push_back(face);
    }
    FORALLvertices hull->corners.emplace_back(Vector3d::Map(vertex->point));
    qh_getarea(qh, qh->facet_list);
    hull->volume = qh->totvol;
  }
  qh_freeqhull(&state, !qh_ALL);
  int rest = 0, bytes = 0;
  qh_memfreeshort(&state, &rest, &bytes);
  return hull;
}

/// The hull of points, without corners that are less than `slack` out of the others' hull.
ConvexPart rounded_part(const std::vector<Vector3d>& points, double slack) {
  const auto hull = hull_of(points);
  const std::vector<Vector3d>& corners = hull ? hull->corners : points;
  std::vector<Vector3d> kept;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [least, most] =
        std::ranges::minmax_element(corners, {}, [axis](const Vector3d& p) { return p[axis]; });
    for (const auto& p : {*least, *most})
      if (std::ranges::find(kept, p) == kept.end()) kept.push_back(p);
  }
  ConvexPart part{rows_of(kept)};
  using Entry = std::pair<double, std::size_t>;  // distance when last looked at, corner
  std::priority_queue<Entry> queue;
  for (std::size_t i = 0; i < corners.size(); ++i)
    queue.emplace(std::numeric_limits<double>::infinity(), i);
  while (!queue.empty()) {  // distances only fall
    const auto [old, i] = queue.top();
    queue.pop();
    const double out =
        math::gap_between(part, {corners[i].transpose()}, Eigen::Isometry3d::Identity(), slack, 1e9)
            .at_most;
    if (out < slack) continue;
    if (!queue.empty() && out < queue.top().first) {
      queue.emplace(out, i);
      continue;
    }
    kept.push_back(corners[i]);
    part.points = rows_of(kept);
  }
  if (kept.size() < corners.size()) part.radius = slack;
  return part;
}

/// What a box holds of a mesh. Its hull is that of the surface in the box and of the corners of the
/// box that are inside: a point inside that is no corner lies between two others.
struct Piece {
  Eigen::AlignedBox3d box;
  std::vector<Triangle> surface;
  std::vector<Vector3d> points;  // corners of its hull
  double reach = 0.0;
};

/// Both sides of the plane where coordinate `axis` is `at`.
std::array<std::vector<Triangle>, 2> cut(const std::vector<Triangle>& surface, int axis,
                                         double at) {
  std::array<std::vector<Triangle>, 2> sides;
  for (const Triangle& t : surface) {
    const auto [least, most] = std::minmax({t[0][axis], t[1][axis], t[2][axis]});
    if (most <= at || least >= at) {
      sides[most > at].push_back(t);
      continue;
    }
    std::array<std::vector<Vector3d>, 2> polygon;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector3d &p = t[i], &next = t[(i + 1) % 3];
      polygon[p[axis] > at].push_back(p);
      if ((p[axis] > at) == (next[axis] > at)) continue;
      Vector3d between = p + (at - p[axis]) / (next[axis] - p[axis]) * (next - p);
      between[axis] = at;
      for (auto& side : polygon) side.push_back(between);
    }
    for (std::size_t side = 0; side < 2; ++side) {
      for (std::size_t i = 2; i < polygon[side].size(); ++i)
        sides[side].push_back({polygon[side][0], polygon[side][i - 1], polygon[side][i]});
    }
  }
  return sides;
}

/// Turns of the surface round what counts as inside: an opening, with half a turn, does.
constexpr double kInside = 0.25;

std::vector<Vector3d> corners_of(const std::vector<Triangle>& surface) {
  std::vector<Vector3d> points;
  points.reserve(3 * surface.size());
  for (const Triangle& t : surface) points.insert(points.end(), t.begin(), t.end());
  const auto key = [](const Vector3d& p) { return std::tuple(p.x(), p.y(), p.z()); };
  std::ranges::sort(points, {}, key);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

/// Calls `at(point)` of some hundred points spread over faces.
template <class At>
void spread_over(const std::vector<Triangle>& faces, const At& at) {
  constexpr double kPoints = 250.0;
  const auto area = [](const Triangle& t) { return 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm(); };
  double all = 0.0;
  for (const Triangle& t : faces) all += area(t);
  for (const Triangle& t : faces) {
    const int n = static_cast<int>(std::ceil(std::sqrt(kPoints * area(t) / all)));
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k + i < n; ++k) {
        const double u = (i + 1.0 / 3.0) / n, v = (k + 1.0 / 3.0) / n;
        at(Vector3d(t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0])));
      }
    }
  }
}

void add_corners_inside(const Eigen::AlignedBox3d& box, const TriangleMesh& mesh,
                        std::vector<Vector3d>& points) {
  for (int i = 0; i < 8; ++i) {
    const Vector3d corner = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
    if (std::abs(mesh.winding(corner)) >= kInside) points.push_back(corner);
  }
}

Piece measured(const Eigen::AlignedBox3d& box, std::vector<Triangle> surface,
               const TriangleMesh& mesh) {
  Piece piece{box, std::move(surface), {}};
  piece.points = corners_of(piece.surface);
  add_corners_inside(box, mesh, piece.points);
  const auto hull = hull_of(piece.points);
  if (!hull) return piece;  // flat: it is its own hull, or nearly
  piece.points = hull->corners;
  spread_over(hull->faces, [&](const Vector3d& p) {
    const double distance = mesh.distance(p);
    if (distance > piece.reach && std::abs(mesh.winding(p)) < kInside) piece.reach = distance;
  });
  return piece;
}

/// Both parts of a box.
std::array<Eigen::AlignedBox3d, 2> cut(const Eigen::AlignedBox3d& box, int axis, double at) {
  std::array<Eigen::AlignedBox3d, 2> sides{box, box};
  sides[0].max()[axis] = sides[1].min()[axis] = at;
  return sides;
}

/// Cuts the piece in two by the plane, of some across each axis, that leaves the least volume;
/// not if none leaves less.
std::optional<std::array<Piece, 2>> halves(const Piece& piece, const TriangleMesh& mesh) {
  constexpr int kPlanes = 8;
  constexpr double kWorth = 0.998;
  constexpr std::size_t kFew = 200;
  const auto volume = [&](const Eigen::AlignedBox3d& box, const std::vector<Triangle>& surface) {
    std::vector<Vector3d> points;
    for (const Triangle& t : surface) points.insert(points.end(), t.begin(), t.end());
    add_corners_inside(box, mesh, points);
    const auto hull = hull_of(points);
    return hull ? hull->volume : 0.0;
  };
  std::vector<Triangle> few;
  const std::size_t step = std::max<std::size_t>(1, piece.surface.size() / kFew);
  for (std::size_t i = 0; i < piece.surface.size(); i += step) few.push_back(piece.surface[i]);
  double least = kWorth * volume(piece.box, few), at = 0.0;
  int across = -1;
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 1; i < kPlanes; ++i) {
      const double there = piece.box.min()[axis] + piece.box.sizes()[axis] * i / kPlanes;
      const auto boxes = cut(piece.box, axis, there);
      const auto trial = cut(few, axis, there);
      const double both = volume(boxes[0], trial[0]) + volume(boxes[1], trial[1]);
      if (both >= least) continue;
      least = both;
      across = axis;
      at = there;
    }
  }
  if (across < 0) return std::nullopt;
  const auto boxes = cut(piece.box, across, at);
  auto sides = cut(piece.surface, across, at);
  if (sides[0].empty() || sides[1].empty()) return std::nullopt;
  return {{measured(boxes[0], std::move(sides[0]), mesh),
           measured(boxes[1], std::move(sides[1]), mesh)}};
}

/// Corners of a box or a cylinder, in S.
std::vector<Vector3d> corners_of(const Solid& solid) {
  constexpr int kSides = 24;
  std::vector<Vector3d> points;
  const Vector3d& half = solid.half_m;
  if (solid.kind == Solid::Kind::ball) points.emplace_back(Vector3d::Zero());
  for (int i = 0; solid.kind == Solid::Kind::box && i < 8; ++i)
    points.push_back(half.cwiseProduct(Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
  for (int i = 0; solid.kind == Solid::Kind::cylinder && i < kSides; ++i) {
    const double turn = 2.0 * std::numbers::pi * i / kSides;
    const double r = half.x() / std::cos(std::numbers::pi / kSides);
    for (const double z : {-half.z(), half.z()})
      points.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
  }
  return points;
}

void place(ConvexPart& part, const Eigen::Isometry3d& X) {
  part.points = ((X.linear() * part.points.transpose()).colwise() + X.translation()).transpose();
}

std::vector<Piece> pieces_of(const TriangleMesh& mesh, double tolerance, std::size_t most) {
  std::vector<Piece> open{measured(mesh.box(), mesh.triangles(), mesh)}, done;
  while (!open.empty()) {
    const auto worst = std::ranges::max_element(open, {}, &Piece::reach);
    if (worst->reach <= tolerance || open.size() + done.size() >= most) break;
    auto both = halves(*worst, mesh);
    if (!both) {
      done.push_back(std::move(*worst));
      open.erase(worst);
      continue;
    }
    *worst = std::move((*both)[0]);
    open.push_back(std::move((*both)[1]));
  }
  std::ranges::move(open, std::back_inserter(done));
  return done;
}

}  // namespace

std::vector<ConvexPart> convex_parts(std::span<const Solid> solids, const PartSettings& settings) {
  const double slack = 0.25 * settings.tolerance_m;
  std::vector<ConvexPart> parts;
  for (const Solid& solid : solids) {
    const std::size_t first = parts.size();
    if (solid.kind == Solid::Kind::mesh) {
      for (const Piece& piece : pieces_of(*solid.mesh, settings.tolerance_m - slack,
                                          static_cast<std::size_t>(settings.most_parts)))
        parts.push_back(rounded_part(piece.points, slack));
    } else {
      const bool ball = solid.kind == Solid::Kind::ball;
      parts.push_back({rows_of(corners_of(solid)), ball ? solid.half_m.x() : 0.0});
    }
    for (std::size_t i = first; i < parts.size(); ++i) place(parts[i], solid.X_LS);
  }
  return parts;
}

ConvexPart hull_around(std::span<const ConvexPart> parts, double slack_m) {
  std::vector<Vector3d> points;
  double radius = 0.0;
  for (const ConvexPart& part : parts) {
    radius = std::max(radius, part.radius);
    for (const auto& point : part.points.rowwise()) points.emplace_back(point.transpose());
  }
  ConvexPart hull = rounded_part(points, slack_m);
  hull.radius += radius;
  return hull;
}

std::vector<Triangle> hull_faces(const ConvexPart& part) {
  std::vector<Vector3d> points;
  for (const auto& p : part.points.rowwise()) points.emplace_back(p.transpose());
  auto hull = hull_of(points);
  if (!hull) return {};
  const Vector3d middle = part.points.colwise().mean().transpose();
  for (Triangle& t : hull->faces) {
    if ((t[1] - t[0]).cross(t[2] - t[0]).dot(t[0] - middle) < 0.0) std::swap(t[1], t[2]);
  }
  return std::move(hull->faces);
}

std::vector<math::RoundBound> balls_around(const ConvexPart& part, int most) {
  const Eigen::RowVector3d lo = part.points.colwise().minCoeff(),
                           size = part.points.colwise().maxCoeff() - lo;
  Eigen::Index axis = 0;
  const double length = size.maxCoeff(&axis);
  const double width = std::hypot(size[(axis + 1) % 3], size[(axis + 2) % 3]);
  const int slices =
      std::clamp(static_cast<int>(std::lround(1.5 * length / std::max(width, 1e-9))), 1, most);
  std::vector<math::RoundBound> balls;
  for (int i = 0; i < slices; ++i) {
    const double from = lo[axis] + length * i / slices, to = lo[axis] + length * (i + 1) / slices;
    // Corners of the slice: of the part, and where the lines between any two cross its planes.
    std::vector<Vector3d> points;
    for (Eigen::Index a = 0; a < part.points.rows(); ++a) {
      const Vector3d p = part.points.row(a);
      if (p[axis] >= from && p[axis] <= to) points.push_back(p);
      for (Eigen::Index b = 0; slices > 1 && b < a; ++b) {
        const Vector3d along = part.points.row(b).transpose() - p;
        for (const double at : {from, to}) {
          const double share = (at - p[axis]) / along[axis];
          if (share > 0.0 && share < 1.0) points.emplace_back(p + share * along);
        }
      }
    }
    if (points.empty()) continue;  // by rounding: its neighbours hold it
    const math::RoundBound around = math::round_bound({rows_of(points), part.radius});
    balls.push_back({around.center, around.radius + 1e-9});
  }
  return balls;
}

OverCoverage over_coverage(std::span<const Solid> solids, std::span<const ConvexPart> parts) {
  constexpr int kPoints = 1 << 13;
  const Eigen::Isometry3d here = Eigen::Isometry3d::Identity();
  OverCoverage over;
  Eigen::AlignedBox3d box = box_of(solids);
  for (const ConvexPart& part : parts) {
    const Vector3d out = Vector3d::Constant(part.radius);
    box.extend(part.points.colwise().minCoeff().transpose() - out);
    box.extend(part.points.colwise().maxCoeff().transpose() + out);
    const auto at = [&](const Vector3d& p) {
      over.reach_m = std::max(over.reach_m, part.radius + signed_distance(solids, p));
    };
    std::vector<Vector3d> points;
    for (const auto& p : part.points.rowwise()) points.emplace_back(p.transpose());
    for (const Vector3d& p : points) at(p);
    if (const auto hull = hull_of(points)) spread_over(hull->faces, at);
  }
  // Roberts' sequence: multiples of the powers of 1/g, g⁴ = g + 1.
  constexpr double kG = 1.2207440846057596;
  const Vector3d by(1.0 / kG, 1.0 / (kG * kG), 1.0 / (kG * kG * kG));
  int in_solid = 0, in_parts = 0, bare = 0;
  for (int i = 0; i < kPoints; ++i) {
    const Vector3d turn = Vector3d::Constant(0.5) + i * by;
    const Vector3d p = box.min() + (turn - turn.array().floor().matrix()).cwiseProduct(box.sizes());
    const bool solid = signed_distance(solids, p) <= 0.0;
    const bool covered = std::ranges::any_of(parts, [&](const ConvexPart& part) {
      return math::gap_between(part, {p.transpose()}, here, 1e-12, 0.0).at_most <= 1e-9;
    });
    in_solid += solid;
    in_parts += covered;
    bare += solid && !covered;
  }
  const double each = box.volume() / kPoints;
  over.solid_m3 = each * in_solid;
  over.parts_m3 = each * in_parts;
  over.bare_m3 = each * bare;
  return over;
}

}  // namespace mimesis::robot
