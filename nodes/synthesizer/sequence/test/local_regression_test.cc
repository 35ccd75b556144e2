#include "nodes/synthesizer/sequence/local_regression.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>

#include "common/error.h"

namespace mimesis::synthesizer {
namespace {

/// Points of a grid in [0, 2] × [0, 1] and what f gives there.
struct Samples {
  Eigen::MatrixXd x, y;
};

Samples grid(const std::function<Eigen::Vector2d(double, double)>& f) {
  Samples s{Eigen::MatrixXd(45, 2), Eigen::MatrixXd(45, 2)};
  for (int i = 0; i < 45; ++i) {
    s.x.row(i) << 0.25 * (i % 9), 0.25 * (i / 9);
    s.y.row(i) = f(s.x(i, 0), s.x(i, 1)).transpose();
  }
  return s;
}

Eigen::Vector2d plane(double a, double b) { return {1.0 + 2.0 * a - b, 0.5 * b}; }
Eigen::Vector2d wave(double a, double b) { return {std::sin(2.0 * a), std::cos(a) * b}; }

TEST(Hull, NearestPointInClosedForm) {
  Eigen::MatrixXd square(5, 2);
  square << 0, 0, 1, 0, 1, 1, 0, 1, 0.3, 0.6;
  const auto at = [&](double a, double b) {
    return nearest_in_hull(square, Eigen::Vector2d(a, b));
  };
  EXPECT_LT((at(0.4, 0.2) - Eigen::Vector2d(0.4, 0.2)).norm(), 1e-9);
  EXPECT_LT((at(0.4, -3.0) - Eigen::Vector2d(0.4, 0.0)).norm(), 1e-9);
  EXPECT_LT((at(2.0, 0.7) - Eigen::Vector2d(1.0, 0.7)).norm(), 1e-9);
  EXPECT_LT((at(-1.0, 5.0) - Eigen::Vector2d(0.0, 1.0)).norm(), 1e-9);
  Eigen::MatrixXd segment(3, 3);
  segment << 0, 0, 0, 1, 1, 1, 2, 2, 2;
  EXPECT_LT(
      (nearest_in_hull(segment, Eigen::Vector3d(1.5, 0.0, 0.0)) - Eigen::Vector3d::Constant(0.5))
          .norm(),
      1e-9);
}

TEST(InputDomain, BringsInContinuouslyAndSaysHowFar) {
  const Samples s = grid(plane);
  const InputDomain domain(s.x, 0.5);
  EXPECT_FALSE(domain.bring_in(Eigen::Vector2d(1.0, 0.4)).clamped());
  const auto far = domain.bring_in(Eigen::Vector2d(9.0, 0.4));
  EXPECT_TRUE(far.clamped());
  // margin from the edge 2.0, spread of the grid's first input √(5/12)
  EXPECT_NEAR(far.x[0] * std::sqrt(5.0 / 12.0) + 1.0, 2.0 + 0.5 * std::sqrt(5.0 / 12.0), 1e-9);
  EXPECT_NEAR(far.outside, 7.0 / std::sqrt(5.0 / 12.0) - 0.5, 1e-9);
  Eigen::VectorXd last = domain.bring_in(Eigen::Vector2d(4.0, 0.0)).x;
  for (int i = 1; i <= 628; ++i) {
    const double a = 0.01 * i;
    const Eigen::VectorXd now =
        domain.bring_in(Eigen::Vector2d(1.0 + 3.0 * std::cos(a), 3.0 * std::sin(a))).x;
    EXPECT_LT((now - last).norm(), 0.1) << a;
    last = now;
  }
}

TEST(LocalRegression, IsExactOnPlanesAndFollowsCurves) {
  const Samples p = grid(plane), w = grid(wave);
  const LocalRegression on_plane(p.x, p.y, {1.0, 1e-9, 0.0}), on_wave(w.x, w.y);
  EXPECT_LT((on_plane.at(Eigen::Vector2d(1.13, 0.41)).value - plane(1.13, 0.41)).norm(), 1e-6);
  EXPECT_LT((on_wave.at(Eigen::Vector2d(1.13, 0.41)).value - wave(1.13, 0.41)).norm(), 0.08);
  EXPECT_LT(on_wave.bandwidth(), 1.0);  // found by leave-one-out: the curve is narrow
  // beyond the data: the value at the edge
  const MapValue far = on_plane.at(Eigen::Vector2d(1e6, 0.5));
  EXPECT_TRUE(far.clamped());
  EXPECT_LT((far.value - plane(2.0, 0.5)).norm(), 1e-6);
}

TEST(LocalRegression, RidgeShrinksToTheLocalMean) {
  const Samples p = grid(plane);
  const LocalRegression stiff(p.x, p.y, {1e3, 1e9, 0.0});
  EXPECT_LT((stiff.at(Eigen::Vector2d(0.0, 0.0)).value - p.y.colwise().mean().transpose()).norm(),
            1e-5);
}

TEST(LocalRegression, RidgeHalvesTheSlopeWhereItEqualsTheSpread) {
  // far wider than the data: slope Σxy / (Σx² + ρn) = 1/(1 + ρ)
  const Eigen::MatrixXd x = Eigen::Vector2d(-1.0, 1.0);
  const LocalRegression map(x, x, {1e6, 1.0, 0.0});
  EXPECT_NEAR(map.at(Eigen::VectorXd::Constant(1, 1.0)).value[0], 0.5, 1e-9);
}

TEST(LocalRegression, ConfigurationErrors) {
  const Samples s = grid(plane);
  const LocalRegression map(s.x, s.y);
  EXPECT_THROW((void)map.at(Eigen::Vector3d(0, 0, 0)), ConfigError);
  EXPECT_THROW((void)map.at(Eigen::Vector2d(0, std::nan(""))), ConfigError);
}

}  // namespace
}  // namespace mimesis::synthesizer
