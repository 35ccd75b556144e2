// Parts against points that the test draws in and on the solids by formulas of its own.
#include "common/robot/convex_parts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "common/error.h"

namespace mimesis::robot {
namespace {

using Eigen::Vector3d;
using Kind = Solid::Kind;
using Triangle = TriangleMesh::Triangle;

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}

  double in(double a, double b) { return std::uniform_real_distribution(a, b)(random_); }
  Vector3d direction() {
    std::normal_distribution<double> normal;
    return Vector3d(normal(random_), normal(random_), normal(random_)).normalized();
  }
  Eigen::Isometry3d pose() {
    Eigen::Isometry3d X(Eigen::AngleAxisd(in(0.0, 3.0), direction()));
    X.translation() = in(0.0, 0.2) * direction();
    return X;
  }
  Solid solid(Kind kind) {
    return {
        .kind = kind, .X_LS = pose(), .half_m = {in(0.01, 0.12), in(0.01, 0.12), in(0.01, 0.25)}};
  }
  /// Uniform in a primitive; on its boundary if asked to.
  Vector3d point(const Solid& s, bool on_boundary) {
    Vector3d p;
    if (s.kind == Kind::ball) {
      p = s.half_m.x() * (on_boundary ? 1.0 : std::cbrt(in(0.0, 1.0))) * direction();
    } else if (s.kind == Kind::box) {
      p = {in(-1.0, 1.0), in(-1.0, 1.0), in(-1.0, 1.0)};
      if (on_boundary) p[static_cast<int>(in(0.0, 2.999))] = in(0.0, 1.0) < 0.5 ? -1.0 : 1.0;
      p = p.cwiseProduct(s.half_m);
    } else {
      const double turn = in(0.0, 2.0 * std::numbers::pi);
      double r = std::sqrt(in(0.0, 1.0)), z = in(-1.0, 1.0);
      if (on_boundary && in(0.0, 1.0) < 0.5) {
        r = 1.0;
      } else if (on_boundary) {
        z = z < 0.0 ? -1.0 : 1.0;
      }
      p = {s.half_m.x() * r * std::cos(turn), s.half_m.x() * r * std::sin(turn), s.half_m.z() * z};
    }
    return s.X_LS * p;
  }

 private:
  std::mt19937_64 random_;
};

/// How far p is from the nearest part.
double outside(const std::vector<math::ConvexPart>& parts, const Vector3d& p) {
  double least = 1e9;
  for (const math::ConvexPart& part : parts)
    least = std::min(
        least, math::gap_between(part, {p.transpose()}, Eigen::Isometry3d::Identity(), 1e-7, 1e-7)
                   .at_most);
  return least;
}

/// Distance from a primitive, found by moving to its nearest point; 0 inside.
double distance_from(const Solid& s, const Vector3d& p_L) {
  const Vector3d p = s.X_LS.inverse() * p_L;
  Vector3d nearest = p;
  if (s.kind == Kind::box) {
    for (int i = 0; i < 3; ++i) nearest[i] = std::clamp(p[i], -s.half_m[i], s.half_m[i]);
  } else if (s.kind == Kind::ball) {
    if (p.norm() > s.half_m.x()) nearest *= s.half_m.x() / p.norm();
  } else {
    const double r = p.head<2>().norm();
    if (r > s.half_m.x()) nearest.head<2>() *= s.half_m.x() / r;
    nearest.z() = std::clamp(p.z(), -s.half_m.z(), s.half_m.z());
  }
  return (p - nearest).norm();
}

double distance_from(const std::vector<Solid>& solids, const Vector3d& p) {
  double least = 1e9;
  for (const Solid& s : solids) least = std::min(least, distance_from(s, p));
  return least;
}

void expect_covered(Draw& draw, const std::vector<Solid>& solids,
                    const std::vector<math::ConvexPart>& parts, int points) {
  double worst = -1e9;
  for (int i = 0; i < points; ++i) {
    const Solid& s = solids[static_cast<std::size_t>(i) % solids.size()];
    worst = std::max(worst, outside(parts, draw.point(s, i % 3 != 0)));
  }
  EXPECT_LE(worst, 2e-6);
}

TEST(ConvexParts, HoldPrimitivesAndReachOutByLittle) {
  Draw draw(2026);
  for (int trial = 0; trial < 12; ++trial) {
    SCOPED_TRACE(trial);
    std::vector<Solid> solids;
    for (int i = 0; i <= trial % 3; ++i)
      solids.push_back(draw.solid(Kind(int(draw.in(0.0, 2.999)))));
    const auto parts = convex_parts(solids, {});
    EXPECT_EQ(parts.size(), solids.size());
    expect_covered(draw, solids, parts, 10'000);
    for (const math::ConvexPart& part : parts) {
      for (const auto& corner : part.points.rowwise())
        EXPECT_LE(distance_from(solids, corner.transpose()) - 1e-9, 0.12 * (1 / 0.9914 - 1));
    }
    EXPECT_LT(over_coverage(solids, parts).reach_m, 0.002);
  }
}

TEST(ConvexParts, ABallIsItself) {
  const std::vector<Solid> solids{{.kind = Kind::ball, .half_m = Vector3d::Constant(0.08)}};
  const auto parts = convex_parts(solids, {});
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].points.rows(), 1);
  EXPECT_EQ(parts[0].radius, 0.08);
}

TEST(OverCoverage, IsThatOfMonteCarlo) {
  Draw draw(11);
  const std::vector<Solid> solids{draw.solid(Kind::cylinder), draw.solid(Kind::ball)};
  const auto parts = convex_parts(solids, {});
  const OverCoverage over = over_coverage(solids, parts);
  constexpr double kHalf = 1.0;
  constexpr int kPoints = 1'000'000;
  int in_solid = 0;
  for (int i = 0; i < kPoints; ++i) {
    const Vector3d p(draw.in(-kHalf, kHalf), draw.in(-kHalf, kHalf), draw.in(-kHalf, kHalf));
    in_solid += distance_from(solids, p) == 0.0;
  }
  const double each = std::pow(2.0 * kHalf, 3) / kPoints;
  EXPECT_NEAR(over.solid_m3 / (each * in_solid), 1.0, 5.0 / std::sqrt(in_solid) + 0.04);
  EXPECT_NEAR(over.parts_m3 / over.solid_m3, 1.01, 0.02);
  EXPECT_EQ(over.bare_m3, 0.0);
  EXPECT_GT(over_coverage(solids, std::span(parts).first(1)).bare_m3, 0.0) << "one was taken away";
}

TEST(BallsAround, HoldTheirPart) {
  Draw draw(17);
  for (int trial = 0; trial < 40; ++trial) {
    math::ConvexPart part{Eigen::MatrixX3d(12, 3), draw.in(0.0, 0.02)};
    const Vector3d size(draw.in(0.01, 0.1), draw.in(0.01, 0.1), draw.in(0.01, 0.5));
    for (Eigen::Index i = 0; i < 12; ++i)
      part.points.row(i) =
          size.cwiseProduct(Vector3d(draw.in(-1, 1), draw.in(-1, 1), draw.in(-1, 1))).transpose();
    const auto balls = balls_around(part);
    double worst = -1e9;
    for (int i = 0; i < 4000; ++i) {
      Eigen::VectorXd weights = Eigen::VectorXd::NullaryExpr(12, [&] { return draw.in(0, 1); });
      weights = weights.array().pow(i % 2 == 0 ? 8.0 : 1.0);
      const Vector3d p =
          part.points.transpose() * (weights / weights.sum()) + part.radius * draw.direction();
      double out = 1e9;
      for (const math::RoundBound& ball : balls)
        out = std::min(out, (p - ball.center).norm() - ball.radius);
      worst = std::max(worst, out);
    }
    EXPECT_LE(worst, 0.0);
  }
}

/// A box of two triangles a face, each divided n² times.
std::vector<Triangle> box_mesh(const Vector3d& half, int n) {
  std::vector<Triangle> out;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const auto at = [&](int i, int k) {
        Vector3d p;
        p[axis] = side;
        p[(axis + 1) % 3] = side * (2.0 * i / n - 1.0);  // the same sense of rotation from outside
        p[(axis + 2) % 3] = 2.0 * k / n - 1.0;
        return Vector3d(p.cwiseProduct(half));
      };
      for (int i = 0; i < n; ++i) {
        for (int k = 0; k < n; ++k) {
          out.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
          out.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
        }
      }
    }
  }
  return out;
}

TEST(TriangleMesh, DistancesAndInsideAreThoseOfTheBox) {
  Draw draw(5);
  const Vector3d half(0.05, 0.1, 0.2);
  const auto mesh = std::make_shared<const TriangleMesh>(box_mesh(half, 7));
  const Eigen::Isometry3d X = draw.pose();
  const std::vector<Solid> of_mesh{{.kind = Kind::mesh, .X_LS = X, .mesh = mesh}};
  const std::vector<Solid> of_box{{.kind = Kind::box, .X_LS = X, .half_m = half}};
  for (int i = 0; i < 20'000; ++i) {
    const Vector3d p = X * Vector3d(draw.in(-0.3, 0.3), draw.in(-0.3, 0.3), draw.in(-0.3, 0.3));
    EXPECT_NEAR(signed_distance(of_mesh, p), signed_distance(of_box, p), 1e-9);
  }
}

/// A tube's quarter bend, or half a ring: no hull holds it closely.
std::vector<Triangle> half_ring(double radius, double thick, bool closed) {
  constexpr int kAlong = 40, kRound = 16;
  std::vector<Triangle> out;
  const auto at = [&](int i, int k) {
    const double turn = M_PI * i / kAlong, round = 2.0 * M_PI * k / kRound;
    const double r = radius + thick * std::cos(round);
    return Vector3d(r * std::cos(turn), r * std::sin(turn), thick * std::sin(round));
  };
  for (int i = 0; i < kAlong; ++i) {
    for (int k = 0; k < kRound; ++k) {
      out.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      out.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
  for (int k = 1; closed && k + 1 < kRound; ++k) {
    out.push_back({at(0, 0), at(0, k), at(0, k + 1)});
    out.push_back({at(kAlong, 0), at(kAlong, k + 1), at(kAlong, k)});
  }
  return out;
}

/// Its surface, and its inside where it is closed: what planes have cut is whole again.
TEST(ConvexParts, HoldWhatIsNotConvexAndFollowIt) {
  Draw draw(13);
  for (const bool closed : {true, false}) {
    SCOPED_TRACE(closed ? "closed" : "open at both ends");
    const double radius = 0.2, thick = 0.04;
    const auto mesh = std::make_shared<const TriangleMesh>(half_ring(radius, thick, closed));
    const std::vector<Solid> solids{{.kind = Kind::mesh, .X_LS = draw.pose(), .mesh = mesh}};
    const auto parts = convex_parts(solids, {.tolerance_m = 0.01, .most_parts = 40});
    EXPECT_GT(parts.size(), 4u);
    EXPECT_LE(parts.size(), 40u);
    if (closed) {  // an opening is no surface: its middle is as far from the mesh as its rim
      EXPECT_LT(over_coverage(solids, parts).reach_m, 0.013);
    }
    double worst = -1e9, middle = 1e9;
    for (int i = 0; i < 20'000; ++i) {
      const auto& triangles = mesh->triangles();
      const Triangle& t = triangles[static_cast<std::size_t>(i) % triangles.size()];
      double u = draw.in(0.0, 1.0), v = draw.in(0.0, 1.0);
      if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
      const Vector3d on = t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]);
      worst = std::max(worst, outside(parts, solids[0].X_LS * on));
      const double turn = draw.in(0.05, M_PI - 0.05), out = 0.9 * thick * draw.in(-1.0, 1.0);
      const Vector3d in((radius + out) * std::cos(turn), (radius + out) * std::sin(turn), 0.0);
      worst = std::max(worst, outside(parts, solids[0].X_LS * in));
      middle = std::min(middle, outside(parts, solids[0].X_LS * Vector3d(0.0, 0.05, 0.0)));
    }
    EXPECT_LE(worst, 2e-6);
    EXPECT_GT(middle, 0.05) << "the hole";
    const auto again = convex_parts(solids, {.tolerance_m = 0.01, .most_parts = 40});
    ASSERT_EQ(again.size(), parts.size());
    for (std::size_t i = 0; i < parts.size(); ++i) EXPECT_EQ(again[i].points, parts[i].points);
    EXPECT_EQ(convex_parts(solids, {.tolerance_m = 0.01, .most_parts = 3}).size(), 3u);
  }
}

/// A star of eight points: its pieces meet inside, where no surface is.
TEST(ConvexParts, HoldTheMiddleOfWhatIsCutInEight) {
  Draw draw(23);
  const double tip = 0.1, dent = 0.05;
  std::vector<Triangle> star;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const auto at = [&](int i) {  // around a face: four tips, and what is between them
        constexpr std::array<int, 9> kRound{1, 1, 0, -1, -1, -1, 0, 1, 1};
        const int u = kRound[static_cast<std::size_t>(i)],
                  v = kRound[static_cast<std::size_t>((i + 6) % 8)];
        const double out = u != 0 && v != 0 ? tip : dent;
        Vector3d p;
        p[axis] = side * out;
        p[(axis + 1) % 3] = side * u * out;
        p[(axis + 2) % 3] = v * out;
        return p;
      };
      for (int i = 0; i < 8; ++i)
        star.push_back({at(i), at((i + 1) % 8), side * dent * Vector3d::Unit(axis)});
    }
  }
  const std::vector<Solid> solids{
      {.kind = Kind::mesh, .mesh = std::make_shared<const TriangleMesh>(star)}};
  EXPECT_LT(signed_distance(solids, Vector3d::Zero()), -0.03);
  const auto parts = convex_parts(solids, {.tolerance_m = 0.005, .most_parts = 60});
  EXPECT_GE(parts.size(), 8u);
  double worst = -1e9;
  for (int i = 0; i < 20'000; ++i)
    worst = std::max(worst, outside(parts, Vector3d(draw.in(-dent, dent), draw.in(-dent, dent),
                                                    draw.in(-dent, dent))));
  EXPECT_LE(worst, 2e-6);
}

TEST(ConvexParts, HoldMeshesOfSeveralBodiesAndWithMissingFaces) {
  Draw draw(13);
  const Solid a = draw.solid(Kind::box), b = draw.solid(Kind::box);
  std::vector<Triangle> both;  // two boxes that overlap, in one mesh
  for (const Solid& s : {a, b}) {
    for (const Triangle& t : box_mesh(s.half_m, 3))
      both.push_back({s.X_LS * t[0], s.X_LS * t[1], s.X_LS * t[2]});
  }
  const std::vector<Solid> closed{
      {.kind = Kind::mesh, .mesh = std::make_shared<const TriangleMesh>(both)}};
  expect_covered(draw, {a, b}, convex_parts(closed, {}), 20'000);

  both.resize(both.size() / 3);  // faces are missing
  const std::vector<Solid> open{
      {.kind = Kind::mesh, .mesh = std::make_shared<const TriangleMesh>(both)}};
  const auto shell = convex_parts(open, {});
  double worst = -1e9;
  for (int i = 0; i < 20'000; ++i) {
    const Triangle& t = both[static_cast<std::size_t>(i) % both.size()];
    double u = draw.in(0.0, 1.0), v = draw.in(0.0, 1.0);
    if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
    worst = std::max(worst, outside(shell, t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0])));
  }
  EXPECT_LE(worst, 2e-6);
}

/// One triangle, and one that is a line: flat parts hold them.
TEST(ConvexParts, HoldFlatMeshes) {
  const Triangle flat{Vector3d(0, 0, 0.1), Vector3d(0.1, 0, 0.1), Vector3d(0, 0.2, 0.1)};
  const Triangle line{Vector3d(0, 0, 0), Vector3d(0.1, 0, 0), Vector3d(0.2, 0, 0)};
  for (const Triangle& t : {flat, line}) {
    const std::vector<Solid> solids{
        {.kind = Kind::mesh, .mesh = std::make_shared<const TriangleMesh>(std::vector{t})}};
    const auto parts = convex_parts(solids, {});
    for (const Vector3d& p : {t[0], t[1], t[2], Vector3d((t[0] + t[1] + t[2]) / 3.0)})
      EXPECT_LE(outside(parts, p), 2e-6);
  }
}

TEST(TriangleMesh, RefusesNoTrianglesAndWhatIsNotFinite) {
  EXPECT_THROW(TriangleMesh({}), ConfigError);
  EXPECT_THROW(TriangleMesh({{Vector3d(0, 0, NAN), Vector3d::UnitX(), Vector3d::UnitY()}}),
               ConfigError);
}

}  // namespace
}  // namespace mimesis::robot
