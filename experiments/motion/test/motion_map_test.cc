#include "experiments/motion/motion_map.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>

#include "common/error.h"
#include "common/testing/refusal.h"
#include "experiments/motion/gaussian_process.h"

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

Eigen::Vector2d wave(double a, double b) { return {std::sin(2.0 * a), std::cos(a) * b}; }

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

TEST(GaussianProcess, ConfigurationErrors) {
  Samples s = grid(wave);
  EXPECT_THROW(GaussianProcess(s.x.topRows(0), s.y.topRows(0)), ConfigError);
  s.y(3, 1) = std::nan("");
  EXPECT_THROW(GaussianProcess(s.x, s.y), ConfigError);
}

/// Patterns whose weights and mean grow with step length and a distance.
motion::MotionModel walks() {
  motion::MotionModel m;
  m.name = "walks";
  m.tied = true;
  m.task_names = {"distance"};
  m.sources = Eigen::MatrixXd::Ones(2, 10);
  for (int i = 0; i < 6; ++i) {
    motion::Pattern p;
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
  const motion::MotionModel model = walks();
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
  motion::MotionModel model = walks();
  const std::string refused = mimesis::testing::refusal(
      [&] { const MotionMap map(model, {TaskInput::task("height")}, LocalRegressionOptions{}); });
  EXPECT_EQ(refused, "map: model 'walks' has no task parameter 'height'");
  EXPECT_THROW(MotionMap(model, {}, LocalRegressionOptions{}), ConfigError);
  model.tied = false;
  EXPECT_THROW(MotionMap(model, {TaskInput::duration()}, LocalRegressionOptions{}), ConfigError);
}

}  // namespace
}  // namespace mimesis::synthesizer
