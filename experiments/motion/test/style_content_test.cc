#include "experiments/motion/style_content.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "common/error.h"
#include "experiments/motion/planar_arm.h"
#include "experiments/motion/svd.h"

namespace mimesis::synthesizer {
namespace {

/// Motions with goals in [0, 1] and styles in [−1, 1] on a grid; the direction turns by 2 rad.
struct Set {
  Eigen::MatrixXd goals, features;
  Eigen::VectorXd style;
};

Eigen::Vector2d mean_at(double g) { return {std::sin(2.0 * g), 0.5 * g}; }
Eigen::Vector2d direction_at(double g) { return {std::cos(2.0 * g), std::sin(2.0 * g)}; }

Set turning() {
  Set s{Eigen::MatrixXd(210, 1), Eigen::MatrixXd(210, 2), Eigen::VectorXd(210)};
  for (int i = 0; i < 210; ++i) {
    const double g = (i % 21) / 20.0, v = (i / 21) / 4.5 - 1.0;
    s.goals(i, 0) = g;
    s.style[i] = v;
    s.features.row(i) = (mean_at(g) + v * direction_at(g)).transpose();
  }
  return s;
}

Eigen::VectorXd one(double x) { return Eigen::VectorXd::Constant(1, x); }

TEST(StyleContent, FindsMeansDirectionsAndStyles) {
  const Set s = turning();
  const StyleContent model(s.goals, s.features);
  const double sign = model.styles()(0, 0) * s.style[0] > 0.0 ? 1.0 : -1.0;
  EXPECT_LT((model.styles().col(0) - sign * s.style).cwiseAbs().maxCoeff(), 0.02);
  for (const double g : {0.03, 0.5, 0.83}) {
    EXPECT_LT((model.mean(one(g)) - mean_at(g)).norm(), 0.01);
    EXPECT_LT((model.directions(one(g)).col(0) - sign * direction_at(g)).norm(), 0.02);
    const Eigen::VectorXd x = model.feature(one(g), one(0.4));
    EXPECT_NEAR(model.style_of(one(g), x)[0], 0.4, 1e-12);
    EXPECT_LT((x - mean_at(g) - sign * 0.4 * direction_at(g)).norm(), 0.02);
  }
}

TEST(StyleContent, ThePrintedDirectionAtANewGoalIsZero) {
  // residuals of a regression have nothing left in the span of its basis
  const Set s = turning();
  Eigen::MatrixXd psi(210, 6);
  for (int i = 0; i < 210; ++i) {
    for (int k = 0; k < 6; ++k) psi(i, k) = std::exp(-12.5 * std::pow(s.goals(i, 0) - 0.2 * k, 2));
  }
  const Eigen::MatrixXd p = psi.completeOrthogonalDecomposition().pseudoInverse();
  const Eigen::MatrixXd r = s.features - psi * (p * s.features);
  EXPECT_LT((p * r).norm(), 1e-9);
  EXPECT_GT(r.norm(), 1.0);
}

TEST(StyleContent, TwoStylesAndTwoGoalInputs) {
  Eigen::MatrixXd goals(400, 2), features(400, 4), styles(400, 2);
  for (int i = 0; i < 400; ++i) {
    const double a = (i % 10) / 9.0, b = (i / 10 % 10) / 9.0;
    const double u = i / 100 % 2 ? 1.0 : -1.0, v = i / 200 ? 0.4 : -0.4;
    goals.row(i) << a, b;
    styles.row(i) << u, v;
    Eigen::Vector4d d, e;
    d << std::cos(a), std::sin(a), 0, 0;
    e << 0, 0, std::cos(b), -std::sin(b);
    features.row(i) = (a * Eigen::Vector4d::Ones() + u * d + v * e).transpose();
  }
  StyleContentOptions options;
  options.styles = 2;
  options.centres = 4;
  const StyleContent model(goals, features, options);
  // up to a rotation of the two styles, which is the same everywhere
  const Svd svd = thin_svd(styles.transpose() * model.styles());
  const Eigen::Matrix2d turn = svd.U * svd.V.transpose();
  EXPECT_LT((styles * turn - model.styles()).cwiseAbs().maxCoeff(), 0.1);
}

TEST(StyleContent, ThePriorDecidesBetweenTwoWaysToMove) {
  Set s = turning();
  // no motion in between
  for (int i = 0; i < 210; ++i) {
    s.style[i] = s.style[i] > 0.0 ? 0.8 + 0.2 * s.style[i] : -0.8 + 0.2 * s.style[i];
    s.features.row(i) =
        (mean_at(s.goals(i, 0)) + s.style[i] * direction_at(s.goals(i, 0))).transpose();
  }
  const StyleContent model(s.goals, s.features);
  const double none = std::numeric_limits<double>::infinity();
  EXPECT_NEAR(model.infer_style(one(0.5), one(0.0), none, {})[0], 0.0, 0.05);
  EXPECT_NEAR(model.infer_style(one(0.5), one(0.7), 0.3, {})[0], 0.87, 0.07);
  EXPECT_NEAR(model.infer_style(one(0.5), one(-0.7), 0.3, {})[0], -0.87, 0.07);
  // a firm prior is kept
  EXPECT_NEAR(model.infer_style(one(0.5), one(-0.7), 1e-3, {})[0], -0.7, 0.01);
}

TEST(StyleContent, ConfigurationErrors) {
  const Set s = turning();
  StyleContentOptions options;
  options.styles = 3;
  EXPECT_THROW(StyleContent(s.goals, s.features, options), ConfigError);
  options = {.styles = 2, .start = StyleContentOptions::Start::norm};
  EXPECT_THROW(StyleContent(s.goals, s.features, options), ConfigError);
  EXPECT_THROW(StyleContent(s.goals.topRows(3), s.features), ConfigError);
  Eigen::MatrixXd bad = s.features;
  bad(0, 0) = std::nan("");
  EXPECT_THROW(StyleContent(s.goals, bad), ConfigError);
  EXPECT_THROW((void)StyleContent(s.goals, s.features).mean(Eigen::Vector2d(0, 0)), ConfigError);
}

TEST(PlanarArm, JacobianIsTheDerivative) {
  const PlanarArm arm{Eigen::Vector3d(0.3, 0.25, 0.15)};
  const Eigen::Vector3d q(0.3, -0.8, 1.1);
  const double h = 1e-6;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d d = h * Eigen::Vector3d::Unit(i);
    EXPECT_LT(((arm.end(q + d) - arm.end(q - d)) / (2 * h) - arm.jacobian(q).col(i)).norm(), 1e-9);
  }
  EXPECT_LT((arm.end(Eigen::Vector3d(0, 0, 0)) - Eigen::Vector2d(0.7, 0.0)).norm(), 1e-12);
}

TEST(PlanarArm, TheSecondTaskDoesNotDisturbTheFirst) {
  const PlanarArm arm{Eigen::Vector3d(0.3, 0.25, 0.15)};
  const Eigen::Vector3d q(0.4, -1.2, 1.0);
  const Eigen::Vector2d from = arm.end(q);
  const auto path = straight_reach(from, from + Eigen::Vector2d(0.05, 0.2), 200);
  Eigen::MatrixXd last[2];
  for (int side = 0; side < 2; ++side) {
    const double s = side ? 1.0 : -1.0;
    const ArmStyle style{Eigen::Vector3d(0.0, 1.2 * s, 0.0), Eigen::Vector3d(0.0, 1.0, 0.0), 4.0};
    const Eigen::MatrixXd m = follow(arm, q, path, 0.005, style);
    for (int t = 0; t < 200; ++t) EXPECT_LT((arm.end(m.col(t)) - path.col(t)).norm(), 1e-5);
    last[side] = m.col(199);
  }
  EXPECT_GT(last[1](1) - last[0](1), 0.5);  // the elbow went where the style wants it
  EXPECT_THROW((void)follow(arm, q, path.rightCols(9), 0.005,
                            {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 1.0}),
               ConfigError);
}

}  // namespace
}  // namespace mimesis::synthesizer
