#include "common/motion/mocap/markers.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>

#include "common/math/so3.h"

namespace mimesis::mocap {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

/// Reproducible noise, uniform in ±√3·σ.
struct Noise {
  std::uint64_t state = 1;
  double next() {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (static_cast<double>(state >> 11) * 0x1p-53 - 0.5) * std::sqrt(12.0);
  }
  Vector3d vector(double sigma) { return sigma * Vector3d(next(), next(), next()); }
};

const Vector3d kCentre_A(0.02, -0.05, -0.3), kCentre_B(-0.03, 0.04, 0.2);

/// Two segments of four markers each, linked at kCentre_A = kCentre_B; B swings against A as a
/// ball joint, or as a hinge about A's y axis.
Markers linked_segments(bool hinge, double noise_m, Index frames = 200) {
  Matrix3Xd shape(3, 4);
  shape << 0.06, -0.05, 0.03, -0.02, 0.04, 0.03, -0.06, -0.01, 0.02, 0.08, -0.03, -0.09;
  Markers m;
  m.name = "made.c3d";
  m.rate_hz = 100.0;
  m.labels = {"A1", "A2", "A3", "A4", "B1", "B2", "B3", "B4"};
  m.position_m.resize(24, frames);
  Noise noise;
  for (Index f = 0; f < frames; ++f) {
    const double t = static_cast<double>(f) / 100.0;
    const Eigen::Matrix3d R_WA = math::exp_so3({0.2 * std::sin(3 * t), 0.1, 0.3 * t});
    const Vector3d p_WA(1.2 * t, 0.02 * std::sin(6 * t), 1.0);
    const Eigen::Matrix3d R_AB =
        math::exp_so3({hinge ? 0.0 : 0.3 * std::sin(5 * t), 0.5 * std::sin(4 * t),
                       hinge ? 0.0 : 0.25 * std::cos(2 * t)});
    const Eigen::Matrix3d R_WB = R_WA * R_AB;
    const Vector3d p_WB = R_WA * kCentre_A + p_WA - R_WB * kCentre_B;
    for (Index i = 0; i < 4; ++i) {
      m.position_m.block<3, 1>(3 * i, f) = R_WA * shape.col(i) + p_WA + noise.vector(noise_m);
      m.position_m.block<3, 1>(12 + 3 * i, f) = R_WB * shape.col(i) + p_WB + noise.vector(noise_m);
    }
  }
  return m;
}

const MarkerGroup kA = {0, 1, 2, 3}, kB = {4, 5, 6, 7};

TEST(RigidFit, RecoversAPoseAndIsNoReflection) {
  Matrix3Xd body(3, 4);
  body << 0.0, 0.1, 0.0, 0.05, 0.0, 0.0, 0.1, 0.05, 0.0, 0.0, 0.0, 0.0;  // flat: a mirror fits too
  const Eigen::Matrix3d R = math::exp_so3({0.4, -2.0, 1.1});
  const Vector3d p(1.0, 2.0, 3.0);
  Matrix3Xd world = (R * body).colwise() + p;
  const auto fit = fit_rigid(body, world);
  ASSERT_TRUE(fit);
  EXPECT_LT((fit->R_WB - R).norm(), 1e-12);
  EXPECT_LT((fit->p_WB - p).norm(), 1e-12);
  world(0, 3) = NAN;
  EXPECT_TRUE(fit_rigid(body, world));
  world(1, 2) = NAN;
  EXPECT_FALSE(fit_rigid(body, world));
  body.row(1).setZero();
  EXPECT_FALSE(fit_rigid(body, body));  // on a line
}

TEST(GapFilling, AGroupPutsItsMarkerBack) {
  const Markers whole = linked_segments(false, 0.0);
  Markers m = whole;
  m.position_m.block(3, 20, 3, 90).setConstant(NAN);
  m.position_m.block(15, 0, 3, 40).setConstant(NAN);  // from the start on
  fill_gaps(m, std::array{kA, kB});
  EXPECT_LT((m.position_m - whole.position_m).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(GapFilling, TheEndsOfAGapMeetTheMeasuredPath) {
  Markers m = linked_segments(false, 0.0);
  m.position_m.row(3).array() += 0.004 * Eigen::RowVectorXd::LinSpaced(200, -1.0, 1.0).array();
  const Markers slipping = m;  // the marker creeps by 8 mm
  m.position_m.block(3, 150, 3, 40).setConstant(NAN);
  fill_gaps(m, std::array{kA});
  const Eigen::MatrixXd error = (m.position_m - slipping.position_m).middleRows(3, 3);
  EXPECT_LT(error.col(150).norm(), 3e-4);
  EXPECT_LT(error.col(189).norm(), 3e-4);
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 2e-3);
}

TEST(GapFilling, SplinesBridgeShortGapsOnly) {
  const Markers whole = linked_segments(false, 0.0);
  Markers m = whole;
  m.position_m.block(0, 50, 3, 10).setConstant(NAN);
  m.position_m.block(6, 50, 3, 60).setConstant(NAN);   // too long
  m.position_m.block(9, 190, 3, 10).setConstant(NAN);  // has no end
  m.position_m.bottomRows(3).setConstant(NAN);
  fill_gaps(m, {}, 0.3);
  EXPECT_EQ(m.position_m.array().isNaN().count(), 3 * (60 + 10 + 200));
  EXPECT_LT((m.position_m - whole.position_m).topRows(3).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_TRUE(std::isnan(m.position_m(6, 80)));
}

TEST(GapFilling, LeavesAGroupWithoutGeometryToTheSplines) {
  Markers m = linked_segments(false, 0.0);
  m.position_m.block(0, 0, 3, 100).setConstant(NAN);
  m.position_m.block(3, 100, 3, 100).setConstant(NAN);
  fill_gaps(m, std::array{kA});
  EXPECT_EQ(m.position_m.array().isNaN().count(), 3 * 200);
}

}  // namespace
}  // namespace mimesis::mocap
