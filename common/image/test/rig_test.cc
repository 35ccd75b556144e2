#include "common/image/rig.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <random>

#include "common/error.h"

namespace mimesis::image {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

const Lens kWide{640, 480, 533.0, 537.0, 342.0, 235.0, {-0.28, 0.06, 0.001, -0.0008, 0.08}};

/// Two cameras above the table that look at its middle, a baseline of 12 cm apart.
std::array<Camera, 2> pair() {
  View view;
  view.eye_m = {0.1, 0.5, 1.0};
  const Camera left(view);
  view.eye_m[0] += 0.12;
  const Camera right(view);
  return {Camera(kWide, left.R_CT(), left.eye()), Camera(kWide, right.R_CT(), right.eye())};
}

TEST(Lens, DistortsAsTheEquationSays) {
  Lens lens{640, 480, 100.0, 200.0, 10.0, 20.0, {0.1, 0.01, 0.002, 0.003, 0.001}};
  // x = 0.5, y = -1: r² = 1.25, c = 1 + 0.125 + 0.015625 + 0.001953125
  const double c = 1.142578125;
  const Vector2d pixel = lens.project({1.0, -2.0, 2.0});
  EXPECT_NEAR(pixel.x(), 10.0 + 100.0 * (0.5 * c + 2 * 0.002 * -0.5 + 0.003 * (1.25 + 0.5)), 1e-12);
  EXPECT_NEAR(pixel.y(), 20.0 + 200.0 * (-c + 0.002 * (1.25 + 2.0) + 2 * 0.003 * -0.5), 1e-12);
}

TEST(Lens, UndistortsEveryPixelOfThePicture) {
  for (int v = 0; v < kWide.height_px; v += 17) {
    for (int u = 0; u < kWide.width_px; u += 13) {
      const Vector2d p = kWide.normalized({u, v});
      EXPECT_LT((kWide.project({2.0 * p.x(), 2.0 * p.y(), 2.0}) - Vector2d(u, v)).norm(), 1e-8);
    }
  }
}

TEST(Lens, TellsADistortionThatFolds) {
  EXPECT_FALSE(kWide.folds());
  Lens folded = kWide;
  folded.distortion = {-0.6, 0.0, 0.0, 0.0, 0.0};  // r (1 - 0.6 r²) turns back at r = 0.75
  EXPECT_TRUE(folded.folds());
  folded.fx_px = folded.fy_px = 1000.0;  // a narrower picture ends before
  EXPECT_FALSE(folded.folds());
}

TEST(Camera, ProjectsItsTargetToTheMiddleAndKeepsUpAndRight) {
  const Camera camera{View{}};
  const View view;
  const Vector3d target(view.target_m[0], view.target_m[1], view.target_m[2]);
  EXPECT_NEAR((camera.project(target) - Vector2d(319.5, 239.5)).norm(), 0.0, 1e-9);
  EXPECT_GT(camera.project(target + Vector3d(0.1, 0, 0)).x(), 319.5);
  EXPECT_LT(camera.project(target + Vector3d(0, 0.1, 0)).y(), 239.5);
  EXPECT_LT(camera.depth(target + Vector3d(0, 0, 0.1)), camera.depth(target));
  EXPECT_NEAR((camera.R_CT() * camera.R_CT().transpose() - Eigen::Matrix3d::Identity()).norm(), 0.0,
              1e-12);
  EXPECT_NEAR(camera.R_CT().determinant(), 1.0, 1e-12);
}

TEST(Camera, FindsPointsOfThePlaneOfMotionAgain) {
  const Camera camera{View{}};
  for (const double x : {-0.4, -0.1, 0.0, 0.3}) {
    for (const double y : {0.0, 0.12, 0.4}) {
      const Vector2d pixel = camera.project({x, y, 0.0});
      const auto p = camera.on_plane(pixel.x(), pixel.y());
      ASSERT_TRUE(p);
      EXPECT_NEAR(p->x(), x, 1e-9);
      EXPECT_NEAR(p->y(), y, 1e-9);
    }
  }
}

TEST(Camera, RefusesAViewWithoutDirection) {
  View view;
  view.eye_m = {0.0, 1.0, 0.0};
  view.target_m = {0.0, 0.0, 0.0};
  EXPECT_THROW(Camera{view}, ConfigError);
}

TEST(Triangulate, FindsThePointAndAnHonestCovariance) {
  const auto cameras = pair();
  const Vector3d p(0.05, 0.12, 0.03);
  std::mt19937 random(8);
  constexpr double kSigma = 0.3;
  constexpr int kDraws = 3000;
  std::normal_distribution<double> noise(0.0, kSigma);
  Matrix3d seen = Matrix3d::Zero();
  Matrix3d claimed;
  for (int i = 0; i < kDraws; ++i) {
    std::array<Sighting, 2> sightings{{{&cameras[0], cameras[0].project(p), kSigma},
                                       {&cameras[1], cameras[1].project(p), kSigma}}};
    if (i == 0) {
      const auto exact = triangulate(sightings);
      ASSERT_TRUE(exact);
      EXPECT_LT((exact->p_T - p).norm(), 1e-9);
      EXPECT_LT(exact->residual_px, 1e-9);
      claimed = exact->covariance_m2;
    }
    for (Sighting& s : sightings) s.pixel += Vector2d(noise(random), noise(random));
    const auto found = triangulate(sightings);
    ASSERT_TRUE(found);
    const Vector3d error = found->p_T - p;
    seen += error * error.transpose() / kDraws;
  }
  // Whitened by the claim, the errors have the unit matrix; its elements scatter by 1/sqrt(3000).
  const Matrix3d root_inverse = Matrix3d(claimed.llt().matrixL()).inverse();
  const Matrix3d whitened = root_inverse * seen * root_inverse.transpose();
  EXPECT_LT((whitened - Matrix3d::Identity()).cwiseAbs().maxCoeff(), 0.12) << whitened;
  // Depth is what a pair knows least.
  const Vector3d axis = cameras[0].R_CT().row(2);
  EXPECT_GT(axis.dot(claimed * axis), 0.8 * claimed.trace());
}

TEST(Triangulate, RefusesParallelRaysAndPointsBehind) {
  const auto cameras = pair();
  const Vector3d p(0.0, 0.1, 0.0);
  const Vector2d pixel = cameras[0].project(p);
  const std::array<Sighting, 2> same{{{&cameras[0], pixel}, {&cameras[0], pixel}}};
  EXPECT_FALSE(triangulate(same));
  EXPECT_FALSE(triangulate(std::span(same).first(1)));
  EXPECT_FALSE(triangulate({}));
  // Rays that part: they would meet behind the cameras.
  const std::array<Sighting, 2> parting{
      {{&cameras[0], {100.0, 240.0}}, {&cameras[1], {540.0, 240.0}}}};
  EXPECT_FALSE(triangulate(parting));
}

TEST(Epipolar, DistanceIsZeroForAPointAndThatOfAShiftAcrossTheLine) {
  const auto cameras = pair();
  const Vector3d p(0.02, 0.1, 0.05);
  const Vector2d a = cameras[0].project(p), b = cameras[1].project(p);
  EXPECT_LT(epipolar_distance(cameras[0], cameras[1], a, b), 1e-9);
  // Near the middle rows of these cameras are almost epipolar lines, and the lens almost straight.
  const Vector2d shift(0.0, 1.0);
  EXPECT_NEAR(epipolar_distance(cameras[0], cameras[1], a, b + shift), 1.0, 0.1);
  EXPECT_NEAR(epipolar_distance(cameras[0], cameras[1], a + shift, b), 1.0, 0.1);
}

TEST(Rectification, PutsAPointInOneRowAndTellsItsDepth) {
  auto cameras = pair();
  // The right one is turned, too.
  const Matrix3d turn =
      (Eigen::AngleAxisd(0.05, Vector3d::UnitZ()) * Eigen::AngleAxisd(-0.08, Vector3d::UnitX()))
          .toRotationMatrix();
  cameras[1] = Camera(kWide, turn * cameras[1].R_CT(), cameras[1].eye());
  const Rectification turned(cameras[0], cameras[1]);
  EXPECT_NEAR(turned.baseline_m(), 0.12, 1e-12);
  for (const Vector3d& p :
       {Vector3d(0.0, 0.1, 0.0), Vector3d(0.2, 0.0, 0.1), Vector3d(-0.1, 0.3, -0.2)}) {
    const Vector2d pixel = cameras[0].project(p);
    const Vector2d a = turned.rectified(0, pixel), b = turned.rectified(1, cameras[1].project(p));
    EXPECT_NEAR(a.y(), b.y(), 1e-7);
    ASSERT_GT(a.x(), b.x());
    // Both cameras look almost the same way, so their depths differ little from the common one.
    const double depth = turned.focal_px() * turned.baseline_m() / (a.x() - b.x());
    EXPECT_NEAR(depth, cameras[0].depth(p), 0.05 * depth);
    EXPECT_LT((turned.original(0, a) - pixel).norm(), 1e-6);
  }
  // All of both pictures is there.
  for (const int side : {0, 1}) {
    for (const Vector2d& corner :
         {Vector2d(0, 0), Vector2d(639, 0), Vector2d(0, 479), Vector2d(639, 479)}) {
      const Vector2d at = turned.rectified(side, corner);
      EXPECT_TRUE(at.x() > -1e-6 && at.y() > -1e-6 && at.x() < 639 + 1e-6 && at.y() < 479 + 1e-6)
          << at;
    }
  }
  EXPECT_THROW(Rectification(cameras[0], cameras[0]), ConfigError);
}

}  // namespace
}  // namespace mimesis::image
