#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>

#include "common/error.h"
#include "nodes/synthesizer/control/gaussian_process.h"
#include "nodes/synthesizer/control/local_regression.h"
#include "nodes/synthesizer/control/motion_map.h"

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

TEST(GaussianProcess, FindsTheScaleOfTheDataAndItsNoise) {
  Samples w = grid(wave);
  const GaussianProcess smooth(w.x, w.y);
  EXPECT_LT((smooth.at(Eigen::Vector2d(1.13, 0.41)).value - wave(1.13, 0.41)).norm(), 0.05);
  EXPECT_LT(smooth.covariance().noise, 0.02);
  for (int i = 0; i < 45; ++i) w.y.row(i).array() += 0.3 * std::sin(37.0 * i * i);
  const GaussianProcess noisy(w.x, w.y);
  EXPECT_GT(noisy.covariance().noise, 5.0 * smooth.covariance().noise);
  // sure where there are data, not at the edge
  EXPECT_LT(noisy.deviation(Eigen::Vector2d(1.0, 0.5)), noisy.deviation(Eigen::Vector2d(2.3, 1.2)));
}

TEST(GaussianProcess, IsItsClosedForm) {
  Eigen::MatrixXd x(3, 1), y(3, 1);
  x << -1.0, 0.0, 1.0;
  y << 1.0, 0.0, 2.0;
  GaussianProcessOptions given;
  given.fit = GaussianProcessOptions::Fit::given;
  given.start = {1.0, 0.5, 0.2};
  const GaussianProcess gp(x, y, given);
  const double s = std::sqrt(2.0 / 3.0);
  Eigen::Matrix3d k;
  Eigen::Vector3d to;
  const auto cov = [](double a, double b) {
    return std::exp(-0.5 * (a - b) * (a - b)) + 0.5 * a * b;
  };
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) k(i, j) = cov(x(i) / s, x(j) / s) + (i == j ? 0.2 + 1e-10 : 0.0);
    to[i] = cov(0.4 / s, x(i) / s);
  }
  const double expected = 1.0 + to.dot(k.inverse() * Eigen::Vector3d(0.0, -1.0, 1.0));
  EXPECT_NEAR(gp.at(Eigen::VectorXd::Constant(1, 0.4)).value[0], expected, 1e-9);
  const double variance = cov(0.4 / s, 0.4 / s) - to.dot(k.inverse() * to);
  EXPECT_NEAR(gp.deviation(Eigen::VectorXd::Constant(1, 0.4)), std::sqrt(variance), 1e-9);
}

TEST(Maps, ConfigurationErrors) {
  const Samples s = grid(plane);
  EXPECT_THROW(LocalRegression(s.x, s.y.topRows(3)), ConfigError);
  EXPECT_THROW(LocalRegression(s.x.topRows(1), s.y.topRows(1)), ConfigError);
  EXPECT_THROW(GaussianProcess(s.x.topRows(0), s.y.topRows(0)), ConfigError);
  Eigen::MatrixXd bad = s.y;
  bad(3, 1) = std::nan("");
  EXPECT_THROW(LocalRegression(s.x, bad), ConfigError);
  EXPECT_THROW(GaussianProcess(s.x, bad), ConfigError);
  const LocalRegression map(s.x, s.y);
  EXPECT_THROW((void)map.at(Eigen::Vector3d(0, 0, 0)), ConfigError);
  EXPECT_THROW((void)map.at(Eigen::Vector2d(0, std::nan(""))), ConfigError);
}

/// Patterns whose weights and mean grow with step length and a distance.
MotionModel walks() {
  MotionModel m;
  m.name = "walks";
  m.tied = true;
  m.task_names = {"distance"};
  m.sources = Eigen::MatrixXd::Ones(2, 10);
  for (int i = 0; i < 6; ++i) {
    Pattern p;
    p.trial.clip = "clip" + std::to_string(i / 2);
    p.trial.duration_s = 1.0 + 0.1 * i;
    p.trial.step_length_m = 1.5 - 0.1 * i;
    p.trial.task = {0.3 * i};
    p.mean_rad = Eigen::VectorXd::Constant(3, 0.1 * i);
    p.weight_rad = Eigen::MatrixXd::Constant(3, 2, 0.2 * i);
    p.weight_rad(2, 1) = -0.3 * i;
    p.delay_rad = Eigen::MatrixXd::Constant(3, 2, 0.7);
    m.patterns.push_back(p);
  }
  return m;
}

TEST(MotionMap, GivesParametersOfTheTask) {
  const MotionModel model = walks();
  for (const MotionMap::Options& options :
       {MotionMap::Options(LocalRegressionOptions{2.0, 1e-6, 0.25}),
        MotionMap::Options(GaussianProcessOptions{})}) {
    const MotionMap map(model, {TaskInput::step_length(), TaskInput::task("distance")}, options);
    const auto v = map.at(Eigen::Vector2d(1.25, 0.75));
    EXPECT_FALSE(v.clamped());
    EXPECT_NEAR(v.parameters.mean_rad[1], 0.25, 0.02);
    EXPECT_NEAR(v.parameters.weight_rad(0, 1), 0.5, 0.03);
    EXPECT_NEAR(v.parameters.weight_rad(2, 1), -0.75, 0.05);
    EXPECT_NEAR(v.parameters.frequency_rad_s, 2.0 * 3.14159265 / 1.25, 0.1);
    EXPECT_EQ(v.parameters.delay_rad(2, 1), 0.7);
    EXPECT_TRUE(map.at(Eigen::Vector2d(9.0, 0.75)).clamped());
  }
}

TEST(MotionMap, ConfigurationErrors) {
  MotionModel model = walks();
  try {
    MotionMap(model, {TaskInput::task("height")}, LocalRegressionOptions{});
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_STREQ(e.what(), "map: model 'walks' has no task parameter 'height'");
  }
  EXPECT_THROW(MotionMap(model, {}, LocalRegressionOptions{}), ConfigError);
  model.tied = false;
  EXPECT_THROW(MotionMap(model, {TaskInput::duration()}, LocalRegressionOptions{}), ConfigError);
}

}  // namespace
}  // namespace mimesis::synthesizer
