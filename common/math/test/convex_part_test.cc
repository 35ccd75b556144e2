#include "common/math/convex_part.h"

#include <gtest/gtest.h>

#include <random>

namespace mimesis::math {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

class Draw {
 public:
  double in(double a, double b) { return std::uniform_real_distribution(a, b)(random_); }
  Vector3d point() { return {in(-1.0, 1.0), in(-1.0, 1.0), in(-1.0, 1.0)}; }
  Isometry3d pose(double away) {
    Isometry3d X(Eigen::AngleAxisd(in(-3.0, 3.0), point().normalized()));
    X.translation() = away * point();
    return X;
  }

 private:
  std::mt19937_64 random_{7};
};

ConvexPart box(const Vector3d& half) {
  ConvexPart part{Eigen::MatrixX3d(8, 3)};
  for (int i = 0; i < 8; ++i)
    part.points.row(i) << (i & 1 ? 1 : -1) * half.x(), (i & 2 ? 1 : -1) * half.y(),
        (i & 4 ? 1 : -1) * half.z();
  return part;
}

/// Turned boxes as one sees them: distance of a ball's centre from a box in closed form.
TEST(GapBetween, ABallAndATurnedBox) {
  Draw draw;
  int apart = 0, meet = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vector3d half(draw.in(0.01, 0.5), draw.in(0.01, 0.5), draw.in(0.01, 0.5));
    const Isometry3d X = draw.pose(1.0);
    const Vector3d center = draw.point();
    const double radius = draw.in(0.0, 0.2);
    const Vector3d out = ((X.inverse() * center).cwiseAbs() - half).cwiseMax(0.0);
    const Gap gap = gap_between({center.transpose(), radius}, box(half), X);
    if (out.isZero(0.0)) {
      EXPECT_NEAR(gap.at_most, -radius, 1e-6);
      ++meet;
      continue;
    }
    ++apart;
    EXPECT_LE(gap.at_least, out.norm() - radius + 1e-12);
    EXPECT_GE(gap.at_most, out.norm() - radius - 1e-12);
    EXPECT_LT(gap.at_most - gap.at_least, 2e-6);
  }
  EXPECT_GT(apart, 1000);
  EXPECT_GT(meet, 50);
}

/// Hulls of random points: the bounds hold between the points themselves, agree both ways round,
/// and planes found by many directions never beat them.
TEST(GapBetween, HullsOfRandomPoints) {
  Draw draw;
  int apart = 0, meet = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto hull = [&](double size) {
      ConvexPart part{Eigen::MatrixX3d(4 + static_cast<int>(draw.in(0.0, 60.0)), 3),
                      draw.in(0.0, 0.1)};
      for (Eigen::Index k = 0; k < part.points.rows(); ++k)
        part.points.row(k) = size * draw.point().transpose();
      return part;
    };
    const ConvexPart a = hull(0.4), b = hull(0.3);
    const Isometry3d X = draw.pose(1.2);
    const double radii = a.radius + b.radius;
    const Gap gap = gap_between(a, b, X), back = gap_between(b, a, X.inverse());
    EXPECT_LE(gap.at_least, gap.at_most + 1e-12);
    EXPECT_NEAR(gap.at_most, back.at_most, 3e-6);
    double least = 1e9, planes = -1e9;
    const Eigen::MatrixX3d there =
        ((X.linear() * b.points.transpose()).colwise() + X.translation()).transpose();
    for (const auto& p : there.rowwise())
      least = std::min(least, (a.points.rowwise() - p).rowwise().norm().minCoeff());
    EXPECT_LE(gap.at_least, least - radii + 1e-9);
    for (int k = 0; k < 300; ++k) {
      const Vector3d n = draw.point().normalized();
      planes = std::max(planes, (a.points * n).minCoeff() - (there * n).maxCoeff());
    }
    EXPECT_LE(planes - radii, gap.at_most + 1e-9);
    gap.at_least > 0.0 ? ++apart : ++meet;
    if (gap.at_most > -radii + 1e-6) {
      EXPECT_LT(gap.at_most - gap.at_least, 1e-5);
    }
  }
  EXPECT_GT(apart, 100);
  EXPECT_GT(meet, 100);
}

TEST(GapBetween, EndsWhereTheAnswerIsKnown) {
  const ConvexPart a = box({0.1, 0.1, 0.1}), b = box({0.2, 0.1, 0.3});
  const Isometry3d X(Eigen::Translation3d(1.0, 0.02, 0.03));
  EXPECT_GE(gap_between(a, b, X, 0.1, 0.5).at_least, 0.5);
  EXPECT_LT(gap_between(a, b, X, 0.8, 0.9).at_most, 0.8);
  EXPECT_NEAR(gap_between(a, b, X).at_most, 0.7, 1e-6);
}

/// Points, lines and planes have hulls, too.
TEST(GapBetween, FlatParts) {
  const auto rows = [](std::initializer_list<Vector3d> points) {
    ConvexPart part{Eigen::MatrixX3d(std::ssize(points), 3)};
    Eigen::Index row = 0;
    for (const Vector3d& p : points) part.points.row(row++) = p.transpose();
    return part;
  };
  const ConvexPart square = rows({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0.5, 0.5, 0}});
  const ConvexPart edge = rows({{-1, -1, 0.2}, {2, 2, 0.2}, {0.5, 0.5, 0.2}});
  const Isometry3d here = Isometry3d::Identity();
  EXPECT_NEAR(gap_between(square, edge, here).at_least, 0.2, 1e-6);
  EXPECT_NEAR(gap_between(edge, rows({{0.5, 0.5, 3}}), here).at_most, 2.8, 1e-6);
  EXPECT_NEAR(gap_between(square, rows({{0.5, 0.5, -1}, {0.5, 0.5, 1}}), here).at_most, 0.0, 1e-6);
}

TEST(RoundBound, HoldsThePart) {
  const RoundBound bound = round_bound({box({0.1, 0.2, 0.3}).points, 0.05});
  EXPECT_TRUE(bound.center.isZero());
  EXPECT_NEAR(bound.radius, Vector3d(0.1, 0.2, 0.3).norm() + 0.05, 1e-12);
}

}  // namespace
}  // namespace mimesis::math
