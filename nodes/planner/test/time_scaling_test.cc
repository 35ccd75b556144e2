#include "nodes/planner/time_scaling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

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

TEST(TimeOptimal, IsSlowWhereItCouldNotBeStoppedElse) {
  const auto path = line(3.0);
  const auto slow = time_optimal(path, one(1.0), one(2.0), kPeriod, [](const Stops& stops) {
    const bool there = stops.q1[0] > 1.0 && stops.q0[0] < 1.5;
    return !there || stops.v0.cwiseAbs().cwiseMax(stops.v1.cwiseAbs())[0] < 0.3;
  });
  ASSERT_TRUE(slow);
  double fastest = 0.0;
  for (Eigen::Index k = 0; k < slow->samples(); ++k) {
    const double q = slow->position(0, k);
    if (q > 1.0 && q < 1.5) {
      EXPECT_LT(slow->velocity(0, k), 0.3);
    }
    fastest = std::max(fastest, slow->velocity(0, k));
  }
  EXPECT_GT(fastest, 0.99) << "elsewhere it is as fast as ever";
  EXPECT_FALSE(time_optimal(path, one(1.0), one(2.0), kPeriod, [](const Stops&) { return false; }));
}

TEST(TimeOptimal, PiecesAskedForAtOnceChangeNothing) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    std::mt19937 random(seed);
    const auto draw = [&](double lo, double hi) {
      return std::uniform_real_distribution(lo, hi)(random);
    };
    std::vector<Eigen::VectorXd> waypoints;
    for (unsigned i = 0; i < 2 + seed % 4; ++i)
      waypoints.emplace_back(Eigen::Vector3d(draw(-2, 2), draw(-2, 2), draw(-2, 2)));
    const SmoothPath path(waypoints, 0.15, seed % 3 == 2 ? kNever : kAlways);
    const double from = draw(-1.0, 1.0), slow = draw(0.1, 0.5);
    const auto motion = [&](std::size_t most_pieces, std::size_t& asked) {
      const auto may = [&](const Stops& stops) {
        ++asked;
        double lo = std::min(stops.q0[0], stops.q1[0]);
        const double hi = std::max(stops.q0[0], stops.q1[0]);
        if (stops.before0.size() > 0) lo = std::min(lo, stops.before0[0]);
        return lo > from + 0.3 || hi < from ||
               stops.v0.cwiseAbs().cwiseMax(stops.v1.cwiseAbs()).maxCoeff() <= slow;
      };
      return time_optimal(path, Eigen::Vector3d(1, 2, 1.5), Eigen::Vector3d(4, 8, 6), kPeriod, may,
                          seed % 2 * 0.02, {}, {}, most_pieces);
    };
    std::size_t one_by_one = 0, at_once = 0;
    const auto a = motion(1, one_by_one), b = motion(32, at_once);
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->position, b->position) << seed;
    EXPECT_EQ(a->velocity, b->velocity) << seed;
    EXPECT_LT(at_once, one_by_one) << seed;
  }
}

/// Duration of the fastest motion over L from rest to rest: up to seven segments of constant jerk.
double seven_segments(double L, double v, double a, double j) {
  const double reaches_a = 2.0 * a * a * a / (j * j);  // least L at which a is reached
  if (v * j < a * a)                                   // v is reached before a
    return L >= 2.0 * v * std::sqrt(v / j) ? L / v + 2.0 * std::sqrt(v / j)
                                           : 4.0 * std::cbrt(L / (2.0 * j));
  if (L >= v * (v / a + a / j)) return L / v + v / a + a / j;
  if (L < reaches_a) return 4.0 * std::cbrt(L / (2.0 * j));
  return a / j + std::sqrt(a * a / (j * j) + 4.0 * L / a);
}

TEST(JerkLimited, IsTheProfileOfSevenSegmentsOnALine) {
  std::mt19937 random(11);
  const auto draw = [&](double lo, double hi) {
    return std::exp(std::uniform_real_distribution(std::log(lo), std::log(hi))(random));
  };
  double sum = 0.0;
  constexpr int kLines = 60;
  for (int i = 0; i < kLines; ++i) {
    const double L = draw(0.01, 5.0), v = draw(0.3, 5.0), a = draw(1.0, 20.0),
                 j = a * draw(3.0, 50.0);
    const double took = time_optimal(line(L), one(v), one(a), kPeriod, one(j)).duration_s();
    const double least = seven_segments(L, v, a, j);
    EXPECT_GT(took, 0.985 * least) << L << " " << v << " " << a << " " << j;
    EXPECT_LT(took, 1.2 * least + 2.0 * kPeriod) << L << " " << v << " " << a << " " << j;
    sum += took / least;
  }
  EXPECT_LT(sum / kLines, 1.07);
}

TEST(JerkLimited, DifferencesKeepAllLimitsOnRandomPaths) {
  for (unsigned seed = 0; seed < 24; ++seed) {
    std::mt19937 random(seed);
    const auto draw = [&](double lo, double hi) {
      return std::uniform_real_distribution(lo, hi)(random);
    };
    const int n = 1 + static_cast<int>(seed % 7);
    std::vector<Eigen::VectorXd> waypoints;
    for (unsigned i = 0; i < 2 + seed % 5; ++i) {
      waypoints.emplace_back(n);
      for (double& q : waypoints.back()) q = draw(-1.5, 1.5);
    }
    Eigen::VectorXd v(n), a(n), j(n);
    for (int k = 0; k < n; ++k) {
      v[k] = draw(0.5, 3.0), a[k] = draw(3.0, 15.0), j[k] = a[k] / draw(0.02, 0.3);
    }
    const SmoothPath path(waypoints, draw(0.05, 0.3), seed % 6 == 5 ? kNever : kAlways);
    // Some parts of the way must be slow.
    const double slow = draw(0.2, 1.0), from = draw(-1.0, 1.0);
    const auto may = [&](const Stops& stops) {
      return stops.q0[0] < from || stops.q0[0] > from + 0.3 ||
             stops.v0.cwiseAbs().cwiseMax(stops.v1.cwiseAbs()).maxCoeff() <= slow;
    };
    const auto motion = time_optimal(path, v, a, kPeriod, may, 0.0, j);
    ASSERT_TRUE(motion);
    const auto q = [&](Eigen::Index k) {
      return motion->position.col(std::clamp(k, Eigen::Index{0}, motion->samples() - 1));
    };
    for (Eigen::Index k = -3; k < motion->samples() + 2; ++k) {
      const auto share = [&](const Eigen::VectorXd& d, const Eigen::VectorXd& most, int power) {
        return d.cwiseAbs().cwiseQuotient(most).maxCoeff() / std::pow(kPeriod, power);
      };
      ASSERT_LE(share(q(k + 1) - q(k), v, 1), 1.011) << seed << " " << k;
      ASSERT_LE(share(q(k + 1) - 2.0 * q(k) + q(k - 1), a, 2), 1.021) << seed << " " << k;
      ASSERT_LE(share(q(k + 2) - 3.0 * q(k + 1) + 3.0 * q(k) - q(k - 1), j, 3), 1.031)
          << seed << " " << k;
    }
    // It stays stoppable: no sample is faster than what was allowed there.
    for (Eigen::Index k = 1; k + 1 < motion->samples(); ++k) {
      const bool inside = q(k)[0] > from + 0.02 && q(k)[0] < from + 0.28;
      if (inside) {
        ASSERT_LE(motion->velocity.col(k).cwiseAbs().maxCoeff(), 1.02 * slow) << seed << " " << k;
      }
    }
    EXPECT_EQ(motion->position.leftCols(1), waypoints.front());
    EXPECT_EQ(motion->position.rightCols(1), waypoints.back());
  }
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
  Playback playback(one(2.0));
  playback.start(motion);
  Eigen::Index k = 0;
  for (; !playback.at_rest(); playback.advance(), ++k) {
    ASSERT_EQ(playback.position(), motion.position.col(k)) << k;
    ASSERT_EQ(playback.velocity(), motion.velocity.col(k)) << k;
  }
  EXPECT_EQ(k + 1, motion.samples());
  EXPECT_EQ(playback.position(), motion.position.rightCols(1));
}

TEST(Playback, BrakesFromFullSpeedInTheTimeOfTheLimits) {  // v / a, over v² / 2a
  const auto motion = time_optimal(line(5.0), one(1.0), one(4.0), kPeriod);
  Playback playback(one(4.0));
  playback.start(motion);
  for (int k = 0; k < 300; ++k) playback.advance();
  const double from = playback.position()[0];
  playback.aim_at(0.0);
  int periods = 0;
  for (; !playback.at_rest(); ++periods) playback.advance();
  EXPECT_NEAR(periods * kPeriod, 0.25, 0.011);
  EXPECT_NEAR(playback.position()[0] - from, 0.125, 0.005);
  EXPECT_EQ(playback.velocity()[0], 0.0);
}

/// Motions of any size and limits are stopped and resumed at any time.
TEST(Playback, BrakesAndGoesOnWithinTheLimitsWithoutLeavingThePath) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    const auto draw = [&](double lo, double hi) {
      return std::uniform_real_distribution<double>(lo, hi)(random);
    };
    const int n = 1 + static_cast<int>(seed % 7);
    std::vector<Eigen::VectorXd> waypoints;
    for (int i = 0; i < 5; ++i) waypoints.emplace_back(draw(0.2, 2.0) * Eigen::VectorXd::Random(n));
    Eigen::VectorXd v(n), a(n);
    for (int j = 0; j < n; ++j) v[j] = draw(0.5, 3.0), a[j] = draw(3.0, 15.0);
    const auto motion =
        time_optimal(SmoothPath(waypoints, draw(0.05, 0.3), kAlways), 0.6 * v, 0.6 * a, kPeriod);
    Playback playback(0.95 * a);
    playback.start(motion);
    std::vector<Eigen::VectorXd> driven{playback.position()};
    Eigen::Index before = 0;
    for (int k = 0; !playback.ended(); ++k) {
      ASSERT_LT(k, 100'000) << seed;
      if (draw(0.0, 1.0) < 0.01) playback.aim_at(0.0);
      if (playback.at_rest() && draw(0.0, 1.0) < 0.1) playback.aim_at(1.0);
      const Eigen::MatrixXd ahead = playback.ahead(40);
      playback.advance();
      const Eigen::VectorXd q = playback.position();
      if (ahead.cols() > 0) {
        EXPECT_EQ(ahead.col(0), q);
      }
      driven.push_back(q);
      // Over 25 ms, since the samples' accelerations jump.
      if (const std::size_t m = driven.size(); m > 10) {
        const Eigen::VectorXd mean =
            (q - 2.0 * driven[m - 6] + driven[m - 11]) / (25.0 * kPeriod * kPeriod);
        EXPECT_LE(mean.cwiseQuotient(a).cwiseAbs().maxCoeff(), 1.03) << seed << " " << k;
      }
      double nearest = 1.0;  // of the planned samples and the lines between
      for (Eigen::Index i = before; i < std::min(before + 3, motion.samples() - 1); ++i) {
        const Eigen::VectorXd along = motion.position.col(i + 1) - motion.position.col(i);
        const double share = std::clamp(
            (q - motion.position.col(i)).dot(along) / std::max(along.squaredNorm(), 1e-300), 0.0,
            1.0);
        const double away = (q - motion.position.col(i) - share * along).norm();
        if (away < nearest) nearest = away, before = i;
      }
      EXPECT_LT(nearest, 15.0 * kPeriod * kPeriod / 8.0)
          << seed << ": more than a chord leaves an arc";
    }
  }
}

}  // namespace
}  // namespace mimesis::planner
