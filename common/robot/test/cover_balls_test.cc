// Covers against points that the test draws in and on the solids by formulas of its own.
#include "common/robot/cover_balls.h"

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

/// How far p is from the nearest ball's inside.
double outside(const std::vector<CoverBall>& balls, const Vector3d& p) {
  double least = 1e9;
  for (const CoverBall& b : balls) least = std::min(least, (p - b.center).norm() - b.radius);
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
                    const std::vector<CoverBall>& balls, int points) {
  double worst = -1e9;
  for (int i = 0; i < points; ++i) {
    const Solid& s = solids[static_cast<std::size_t>(i) % solids.size()];
    worst = std::max(worst, outside(balls, draw.point(s, i % 3 != 0)));
  }
  EXPECT_LE(worst, 0.0);
}

TEST(CoverBalls, CoverEveryPointOfPrimitivesAndReachOutByNoMoreThanAsked) {
  Draw draw(2026);
  for (int trial = 0; trial < 10; ++trial) {
    std::vector<Solid> solids;
    double longest = 0.0;
    for (int i = 0; i <= trial % 3; ++i) {
      solids.push_back(draw.solid(Kind(int(draw.in(0.0, 2.999)))));
      longest = std::max(longest, solids.back().half_m.maxCoeff());
    }
    const CoverSettings settings{.tolerance_m = draw.in(0.15, 0.4) * longest, .most_balls = 10000};
    SCOPED_TRACE(trial);
    const std::vector<CoverBall> balls = cover_balls(solids, settings);
    expect_covered(draw, solids, balls, 100'000);
    double reach = 0.0;
    for (int i = 0; i < 20'000; ++i) {
      const CoverBall& b = balls[static_cast<std::size_t>(i) % balls.size()];
      reach = std::max(reach, distance_from(solids, b.center + b.radius * draw.direction()));
    }
    EXPECT_LE(reach, settings.tolerance_m);
    EXPECT_LE(reach, over_coverage(solids, balls).reach_m + 1e-12);
  }
}

TEST(CoverBalls, ABallIsCoveredByOneBallNearlyItsSize) {
  const std::vector<Solid> solids{{.kind = Kind::ball, .half_m = Vector3d::Constant(0.08)}};
  const auto balls = cover_balls(solids, {.tolerance_m = 0.01, .most_balls = 100});
  ASSERT_EQ(balls.size(), 1u);
  EXPECT_LT(balls[0].radius, 0.08 + 0.0015);
}

TEST(CoverBalls, FewerBallsReachOutFarther) {
  Draw draw(7);
  for (const Kind kind : {Kind::box, Kind::cylinder}) {
    const std::vector<Solid> solids{draw.solid(kind)};
    for (const int most : {1, 3, 8}) {
      const auto balls = cover_balls(solids, {.tolerance_m = 0.003, .most_balls = most});
      EXPECT_LE(std::ssize(balls), most);
      expect_covered(draw, solids, balls, 20'000);
    }
  }
}

TEST(CoverBalls, TheSameBitsEachTime) {
  Draw draw(3);
  const std::vector<Solid> solids{draw.solid(Kind::cylinder), draw.solid(Kind::box)};
  const auto once = cover_balls(solids, {}), again = cover_balls(solids, {});
  ASSERT_EQ(once.size(), again.size());
  for (std::size_t i = 0; i < once.size(); ++i) {
    EXPECT_EQ(once[i].center, again[i].center);
    EXPECT_EQ(once[i].radius, again[i].radius);
  }
}

TEST(OverCoverage, IsThatOfMonteCarlo) {
  Draw draw(11);
  const std::vector<Solid> solids{draw.solid(Kind::cylinder), draw.solid(Kind::ball)};
  const auto balls = cover_balls(solids, {.tolerance_m = 0.03, .most_balls = 30});
  const OverCoverage over = over_coverage(solids, balls);
  constexpr double kHalf = 1.0;
  constexpr int kPoints = 2'000'000;
  int in_solid = 0, in_balls = 0;
  for (int i = 0; i < kPoints; ++i) {
    const Vector3d p(draw.in(-kHalf, kHalf), draw.in(-kHalf, kHalf), draw.in(-kHalf, kHalf));
    in_solid += distance_from(solids, p) == 0.0;
    in_balls += outside(balls, p) <= 0.0;
  }
  const double each = std::pow(2.0 * kHalf, 3) / kPoints;
  EXPECT_NEAR(over.solid_m3 / (each * in_solid), 1.0, 5.0 / std::sqrt(in_solid) + 0.01);
  EXPECT_NEAR(over.balls_m3 / (each * in_balls), 1.0, 5.0 / std::sqrt(in_balls) + 0.01);
  EXPECT_EQ(over.bare_m3, 0.0);
  EXPECT_GT(over_coverage(solids, std::span(balls).first(1)).bare_m3, 0.0)
      << "balls were taken away";
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

TEST(CoverBalls, CoverMeshesClosedAndOpenAndOfSeveralParts) {
  Draw draw(13);
  const Solid a = draw.solid(Kind::box), b = draw.solid(Kind::box);
  std::vector<Triangle> both;  // two boxes that overlap, in one mesh
  for (const Solid& s : {a, b}) {
    for (const Triangle& t : box_mesh(s.half_m, 3))
      both.push_back({s.X_LS * t[0], s.X_LS * t[1], s.X_LS * t[2]});
  }
  const std::vector<Solid> closed{
      {.kind = Kind::mesh, .mesh = std::make_shared<const TriangleMesh>(both)}};
  const auto balls = cover_balls(closed, {.tolerance_m = 0.02, .most_balls = 200});
  expect_covered(draw, {a, b}, balls, 50'000);

  both.resize(both.size() / 3);  // faces are missing
  const std::vector<Solid> open{
      {.kind = Kind::mesh, .mesh = std::make_shared<const TriangleMesh>(both)}};
  const auto shell = cover_balls(open, {.tolerance_m = 0.02, .most_balls = 200});
  double worst = -1e9;
  for (int i = 0; i < 50'000; ++i) {
    const Triangle& t = both[static_cast<std::size_t>(i) % both.size()];
    double u = draw.in(0.0, 1.0), v = draw.in(0.0, 1.0);
    if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
    worst = std::max(worst, outside(shell, t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0])));
  }
  EXPECT_LE(worst, 0.0);
}

TEST(TriangleMesh, RefusesNoTrianglesAndWhatIsNotFinite) {
  EXPECT_THROW(TriangleMesh({}), ConfigError);
  EXPECT_THROW(TriangleMesh({{Vector3d(0, 0, NAN), Vector3d::UnitX(), Vector3d::UnitY()}}),
               ConfigError);
}

}  // namespace
}  // namespace mimesis::robot
