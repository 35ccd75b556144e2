#include "experiments/dmp/power_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/error.h"

namespace mimesis::dmp {
namespace {

using Eigen::Vector2d;

double ellipse_curvature(double a, double b, double phi) {
  return a * b / std::pow(std::pow(a * std::sin(phi), 2) + std::pow(b * std::cos(phi), 2), 1.5);
}

TEST(PowerLaw, HoldsOnTheEllipse) {
  for (const double beta : {-1.0 / 3.0, 0.0, 1.0 / 3.0, 2.0 / 3.0}) {
    const PowerLawField field({.long_m = 2.0, .short_m = 1.2, .heading_rad = 0.4, .beta = beta});
    for (double phi = 0.0; phi < 2.0 * std::numbers::pi; phi += 0.3) {
      const Vector2d p = field.on_path(phi);
      const double kappa = ellipse_curvature(2.0, 1.2, phi);
      EXPECT_NEAR(field.curvature(p), kappa, 1e-12);
      EXPECT_NEAR(field.velocity(p).norm(), field.gain() * std::pow(kappa, -beta), 1e-12);
    }
  }
}

/// By steps of the midpoint rule: position after `duration_s`.
Vector2d follow(const PowerLawField& field, Vector2d p, double duration_s, int steps) {
  const double dt = duration_s / steps;
  for (int i = 0; i < steps; ++i) p += dt * field.velocity(p + 0.5 * dt * field.velocity(p));
  return p;
}

TEST(PowerLaw, ALapTakesItsTimeCounterClockwise) {
  for (const double beta : {-1.0 / 3.0, 0.0, 1.0 / 3.0, 2.0 / 3.0}) {
    const PowerLawField field({.center_W_m = {1.0, -2.0}, .beta = beta, .mean_speed_m_s = 0.25});
    EXPECT_NEAR(field.lap_s() * 0.25, field.length_m(), 1e-12);
    EXPECT_NEAR(
        (follow(field, field.on_path(0.0), field.lap_s(), 20000) - field.on_path(0.0)).norm(), 0.0,
        1e-5);
    EXPECT_GT(field.velocity(field.on_path(0.0)).y(), 0.0);
  }
}

TEST(PowerLaw, ACircleIsWalkedEvenlyWhateverTheExponent) {
  const PowerLawField field({.long_m = 1.5, .short_m = 1.5, .beta = 2.0 / 3.0});
  EXPECT_NEAR(field.length_m(), 3.0 * std::numbers::pi, 1e-12);
  for (double phi = 0.0; phi < 6.0; phi += 1.0) {
    EXPECT_NEAR(field.velocity(field.on_path(phi)).norm(), 0.2, 1e-12);
  }
}

TEST(PowerLaw, CurvatureIsThatOfTheTrajectory) {
  const PowerLawField field({.beta = 0.0, .mean_speed_m_s = 1.0, .attraction = 0.7});
  const Vector2d p(1.3, 1.1);  // outside the ellipse
  const double dt = 1e-4;
  const Vector2d before = follow(field, p, -dt, 1), after = follow(field, p, dt, 1);
  const Vector2d v = (after - before) / (2.0 * dt), a = (after - 2.0 * p + before) / (dt * dt);
  EXPECT_NEAR(field.curvature(p), (v.x() * a.y() - v.y() * a.x()) / std::pow(v.norm(), 3), 1e-5);
}

TEST(PowerLaw, StraysComeBackAndKeepTheLaw) {
  const PowerLawPath path{.attraction = 1.0};
  const PowerLawField field(path);
  for (const double stray : {0.75, 1.2}) {
    Vector2d p = stray * field.on_path(0.5);
    double distance = std::abs(stray - 1.0);
    for (int second = 0; second < 70; ++second) {
      p = follow(field, p, 1.0, 200);
      const double now = std::abs(Vector2d(p.x() / path.long_m, p.y() / path.short_m).norm() - 1.0);
      EXPECT_LT(now, distance);
      distance = now;
      EXPECT_NEAR(field.velocity(p).norm(), field.gain() * std::pow(field.curvature(p), -path.beta),
                  1e-12);
    }
    EXPECT_LT(distance, 1e-3);
  }
}

TEST(PowerLaw, OneThirdIsEquiAffine) {
  // The image of the field of a circle under a map of determinant 1 is that of the ellipse, but for
  // the time that a lap takes.
  const PowerLawField circle({.long_m = 1.0, .short_m = 1.0}),
      ellipse({.long_m = 1.6, .short_m = 0.625});
  const double slower = circle.lap_s() / ellipse.lap_s();
  for (const Vector2d& x : {Vector2d(1.0, 0.0), Vector2d(0.6, 0.7), Vector2d(-0.9, 0.8)}) {
    const Vector2d image = Vector2d(1.6, 0.625).asDiagonal() * circle.velocity(x) * slower;
    const Vector2d ours = ellipse.velocity(Vector2d(1.6, 0.625).asDiagonal() * x);
    EXPECT_NEAR((image - ours).norm(), 0.0, 1e-12);
  }
}

TEST(PowerLaw, FarAwayAndAtTheCentreItStaysSane) {
  const PowerLawField field({.beta = 2.0 / 3.0});
  EXPECT_EQ(field.velocity(Vector2d::Zero()), Vector2d::Zero());
  for (const Vector2d& p : {Vector2d(50.0, 1.0), Vector2d(1e-6, 0.0), Vector2d(0.0, -9.0)}) {
    const double speed = field.velocity(p).norm();
    EXPECT_GT(speed, 0.01);
    EXPECT_LT(speed, 1.0);
  }
}

TEST(PowerLaw, RefusesWhatIsNoPath) {
  EXPECT_THROW(PowerLawField({.short_m = 0.0}), ConfigError);
  EXPECT_THROW(PowerLawField({.long_m = 1.0, .short_m = 1.2}), ConfigError);
  EXPECT_THROW(PowerLawField({.beta = 1.5}), ConfigError);
  EXPECT_THROW(PowerLawField({.mean_speed_m_s = -0.1}), ConfigError);
  EXPECT_THROW(PowerLawField({.attraction = 0.0}), ConfigError);
}

}  // namespace
}  // namespace mimesis::dmp
