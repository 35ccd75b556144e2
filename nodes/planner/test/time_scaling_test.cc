#include "nodes/planner/time_scaling.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nodes/planner/roadmap.h"

namespace mimesis::planner {
namespace {

constexpr double kPeriod = 0.005;
const SmoothPath::Accept kAlways = [](const Eigen::MatrixXd&) { return true; };
const SmoothPath::Accept kNever = [](const Eigen::MatrixXd&) { return false; };

SmoothPath line(double length) {
  return SmoothPath({Eigen::VectorXd::Zero(1), Eigen::VectorXd::Constant(1, length)}, 0.1, kAlways);
}

Eigen::VectorXd one(double value) { return Eigen::VectorXd::Constant(1, value); }

std::vector<Eigen::VectorXd> zigzag(int n, int count) {
  const Eigen::MatrixXd points = halton(n, count, 9);
  std::vector<Eigen::VectorXd> waypoints;
  for (Eigen::Index i = 0; i < count; ++i) waypoints.emplace_back(2.0 * points.col(i));
  return waypoints;
}

TEST(TimeOptimal, IsBangBangOnAShortLine) {  // T = 2 √(L / a)
  const auto motion = time_optimal(line(0.5), one(10.0), one(2.0), kPeriod);
  EXPECT_NEAR(motion.duration_s(), 2.0 * std::sqrt(0.5 / 2.0), 1.01 * kPeriod);
}

TEST(TimeOptimal, IsATrapezoidOnALongLine) {  // T = L / v + v / a
  const auto motion = time_optimal(line(3.0), one(1.0), one(2.0), kPeriod);
  EXPECT_NEAR(motion.duration_s(), 3.0 + 0.5, 2.0 * kPeriod);
  EXPECT_NEAR(motion.velocity.maxCoeff(), 1.0, 5e-3);
}

TEST(TimeOptimal, KeepsTheLimitsOfEveryJointAndEndsAtRest) {
  const auto waypoints = zigzag(7, 8);
  const Eigen::VectorXd v = Eigen::VectorXd::LinSpaced(7, 0.8, 2.0),
                        a = Eigen::VectorXd::LinSpaced(7, 3.0, 8.0);
  const auto motion = time_optimal(SmoothPath(waypoints, 0.15, kAlways), v, a, kPeriod);
  EXPECT_EQ(motion.position.leftCols(1), waypoints.front());
  EXPECT_EQ(motion.position.rightCols(1), waypoints.back());
  EXPECT_EQ(motion.velocity.leftCols(1).norm() + motion.velocity.rightCols(1).norm(), 0.0);
  double fastest = 0.0, hardest = 0.0;
  for (Eigen::Index k = 1; k + 1 < motion.samples(); ++k) {
    const Eigen::VectorXd rate =
        (motion.position.col(k + 1) - motion.position.col(k - 1)) / (2 * kPeriod);
    const Eigen::VectorXd change = (motion.velocity.col(k + 1) - motion.velocity.col(k)) / kPeriod;
    // The velocities are those of the positions.
    EXPECT_LT((rate - motion.velocity.col(k)).cwiseAbs().maxCoeff(), 1.1 * kPeriod * a.maxCoeff());
    fastest = std::max(fastest, (motion.velocity.col(k).cwiseAbs().array() / v.array()).maxCoeff());
    hardest = std::max(hardest, (change.cwiseAbs().array() / a.array()).maxCoeff());
  }
  EXPECT_LE(fastest, 1.001);
  EXPECT_LE(hardest, 1.03);  // limits hold at grid points; between them q'' moves a little
  EXPECT_GT(hardest, 0.9);   // time-optimal: some joint is always at its limit
}

TEST(TimeOptimal, StopsAtACornerThatMayNotBeRounded) {
  const std::vector<Eigen::VectorXd> corner{Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0),
                                            Eigen::Vector2d(1, 1)};
  const SmoothPath kept(corner, 0.2, kNever), rounded(corner, 0.2, kAlways);
  ASSERT_EQ(kept.stops().size(), 3u);
  const Eigen::Vector2d v(1.0, 1.0), a(2.0, 2.0);
  const auto motion = time_optimal(kept, v, a, kPeriod);
  Eigen::Index at_corner = 0;
  (motion.position.colwise() - Eigen::Vector2d(1, 0)).colwise().norm().minCoeff(&at_corner);
  EXPECT_LT(motion.velocity.col(at_corner).norm(), 2.0 * kPeriod);
  EXPECT_LT(time_optimal(rounded, v, a, kPeriod).duration_s(), motion.duration_s());
}

TEST(SmoothPath, IsContinuousInTangentAndCurvature) {
  const SmoothPath path(zigzag(3, 6), 0.2, kAlways);
  EXPECT_EQ(path.stops().size(), 2u);
  for (std::size_t i = 1; i + 1 < path.knots().size(); ++i) {
    const auto before = path.at(path.knots()[i] - 1e-7), behind = path.at(path.knots()[i] + 1e-7);
    EXPECT_LT((before.q - behind.q).norm(), 1e-6);
    EXPECT_LT((before.dq - behind.dq).norm(), 1e-4);
    EXPECT_LT((before.ddq - behind.ddq).norm(), 1e-3);
  }
}

TEST(SmoothPath, DerivativesAreThoseOfThePath) {
  const SmoothPath path(zigzag(3, 5), 0.3, kAlways);
  for (double s = 0.01; s < path.length() - 0.01; s += 0.0137) {
    constexpr double kH = 1e-5;
    const auto before = path.at(s - kH), here = path.at(s), behind = path.at(s + kH);
    EXPECT_LT(((behind.q - before.q) / (2 * kH) - here.dq).norm(), 1e-5);
    EXPECT_LT(((behind.dq - before.dq) / (2 * kH) - here.ddq).norm(), 1e-2);
  }
}

TEST(Playback, PlaysEverySampleExactly) {
  const auto motion = time_optimal(line(0.5), one(1.0), one(2.0), kPeriod);
  Playback playback;
  playback.start(motion);
  Eigen::Index k = 0;
  for (; !playback.at_rest(); playback.advance(), ++k) {
    ASSERT_EQ(playback.position(), motion.position.col(k)) << k;
    ASSERT_EQ(playback.velocity(), motion.velocity.col(k)) << k;
  }
  EXPECT_EQ(k + 1, motion.samples());
  EXPECT_EQ(playback.position(), motion.position.rightCols(1));
}

TEST(Playback, BrakesOnThePathToRest) {  // from full speed v in b seconds: v b / 2
  const auto motion = time_optimal(line(5.0), one(1.0), one(4.0), kPeriod);
  Playback playback(0.5);
  playback.start(motion);
  for (int k = 0; k < 300; ++k) playback.advance();
  const double from = playback.position()[0];
  playback.brake();
  double last = from, speed = 1.0;
  while (!playback.at_rest()) {
    playback.advance();
    const double next = (playback.position()[0] - last) / kPeriod;
    EXPECT_LT(std::abs(next - speed), 2.0 * kPeriod / 0.5 + 1e-9);  // v / b, no jump
    speed = next;
    last = playback.position()[0];
  }
  EXPECT_NEAR(last - from, 0.25, 0.005);
  EXPECT_EQ(playback.velocity()[0], 0.0);
}

}  // namespace
}  // namespace mimesis::planner
