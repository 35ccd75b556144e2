#include "common/qp/dual_qp.h"

#include <gtest/gtest.h>

#include "common/qp/test/random_problems.h"
#include "common/testing/no_malloc.h"

namespace mimesis::qp {
namespace {

using Start = DualQp::Start;

/// min ½|x − to|², two variables.
OwnProblem nearest(const Eigen::Vector2d& to) {
  OwnProblem p;
  p.H = Eigen::Matrix2d::Identity();
  p.g = -to;
  p.A.resize(0, 2);
  return p;
}

void add_row(OwnProblem& p, const Eigen::Vector2d& row, double lower, double upper) {
  const Eigen::Index m = p.A.rows();
  p.A.conservativeResize(m + 1, 2);
  p.A.row(m) = row;
  p.lower.conservativeResize(m + 1);
  p.upper.conservativeResize(m + 1);
  p.lower[m] = lower;
  p.upper[m] = upper;
}

TEST(DualQp, FindsTheFreeMinimum) {
  const OwnProblem p = nearest({1.0, -2.0});
  DualQp qp(2, 0);
  ASSERT_EQ(qp.solve(p.view()), Outcome::solved);
  EXPECT_NEAR((qp.x() - Eigen::Vector2d(1.0, -2.0)).norm(), 0.0, 1e-15);
  EXPECT_EQ(qp.iterations(), 0);
  EXPECT_TRUE(qp.active_rows().empty());
}

TEST(DualQp, ProjectsOnALineAHalfPlaneAndACorner) {
  OwnProblem p = nearest({3.0, 1.0});
  add_row(p, {1.0, 1.0}, -kInf, 2.0);  // distance √2, along (1, 1)
  DualQp qp(2, 4);
  ASSERT_EQ(qp.solve(p.view()), Outcome::solved);
  EXPECT_NEAR((qp.x() - Eigen::Vector2d(2.0, 0.0)).norm(), 0.0, 1e-14);
  ASSERT_EQ(qp.active_rows().size(), 1U);
  EXPECT_EQ(qp.active_rows()[0], 0);
  EXPECT_NEAR(qp.multipliers()[0], -1.0, 1e-14);  // x − to = λ(1, 1)

  p.x_lower = Eigen::Vector2d(-1.0, 0.5);
  p.x_upper = Eigen::Vector2d(kInf, kInf);
  ASSERT_EQ(qp.solve(p.view()), Outcome::solved);
  EXPECT_NEAR((qp.x() - Eigen::Vector2d(1.5, 0.5)).norm(), 0.0, 1e-14);
  EXPECT_EQ(std::vector(qp.active_rows().begin(), qp.active_rows().end()), (std::vector{0, 2}));

  add_row(p, {1.0, -1.0}, 0.25, 0.25);  // an equality
  ASSERT_EQ(qp.solve(p.view()), Outcome::solved);
  EXPECT_NEAR((qp.x() - Eigen::Vector2d(1.125, 0.875)).norm(), 0.0, 1e-14);
}

TEST(DualQp, SaysWhichConstraintContradictsAndKeepsItsSolution) {
  OwnProblem p = nearest({0.3, 0.4});
  DualQp qp(2, 3);
  ASSERT_EQ(qp.solve(p.view()), Outcome::solved);
  add_row(p, {1.0, 0.0}, 1.0, kInf);
  add_row(p, {0.0, 1.0}, 1.0, kInf);
  add_row(p, {1.0, 1.0}, -kInf, 1.9);
  EXPECT_EQ(qp.solve(p.view()), Outcome::infeasible);
  EXPECT_EQ(qp.violated_row(), 2);
  EXPECT_EQ(Eigen::Vector2d(qp.x()), Eigen::Vector2d(0.3, 0.4));
  p.upper[2] = 2.0;  // just so
  EXPECT_EQ(qp.solve(p.view()), Outcome::solved);
  EXPECT_EQ(qp.violated_row(), -1);
  EXPECT_NEAR((qp.x() - Eigen::Vector2d(1.0, 1.0)).norm(), 0.0, 1e-14);
  // Two equalities that contradict each other, one that repeats another.
  p = nearest({0.0, 0.0});
  add_row(p, {1.0, 2.0}, 1.0, 1.0);
  add_row(p, {2.0, 4.0}, 2.0, 2.0);
  EXPECT_EQ(qp.solve(p.view()), Outcome::solved);
  add_row(p, {-1.0, -2.0}, -1.5, -1.5);
  EXPECT_EQ(qp.solve(p.view()), Outcome::infeasible);
  EXPECT_EQ(qp.violated_row(), 2);
}

TEST(DualQp, RefusesWhatIsNoProblem) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  OwnProblem good = nearest({0.3, 0.4});
  add_row(good, {1.0, 0.0}, -1.0, 1.0);
  DualQp qp(2, 1);
  ASSERT_EQ(qp.solve(good.view()), Outcome::solved);
  const auto refused = [&](auto change, Outcome expected) {
    OwnProblem bad = good;
    change(bad);
    for (const Start start : {Start::cold, Start::warm}) {
      EXPECT_EQ(qp.solve(bad.view(), start), expected) << name(qp.solve(bad.view(), start));
      EXPECT_EQ(Eigen::Vector2d(qp.x()), Eigen::Vector2d(0.3, 0.4));
    }
    EXPECT_EQ(qp.solve(good.view()), Outcome::solved);
  };
  refused([&](OwnProblem& p) { p.H(0, 1) = nan; }, Outcome::not_finite);
  refused([&](OwnProblem& p) { p.H(1, 1) = kInf; }, Outcome::not_finite);
  refused([&](OwnProblem& p) { p.g[1] = nan; }, Outcome::not_finite);
  refused([&](OwnProblem& p) { p.A(0, 1) = nan; }, Outcome::not_finite);
  refused([&](OwnProblem& p) { p.lower[0] = nan; }, Outcome::not_finite);
  refused([&](OwnProblem& p) { p.upper[0] = -2.0; }, Outcome::not_finite);
  refused([&](OwnProblem& p) { p.lower[0] = p.upper[0] = kInf; }, Outcome::not_finite);
  refused([&](OwnProblem& p) { p.H(1, 1) = 0.0; }, Outcome::not_convex);
  refused([&](OwnProblem& p) { p.H << 1.0, 2.0, 2.0, 1.0; }, Outcome::not_convex);
  refused([&](OwnProblem& p) { p.H.setOnes(); }, Outcome::not_convex);
}

TEST(DualQp, StopsAtItsLimitOfIterations) {
  std::mt19937 random(7);
  const OwnProblem p = random_problem(random, {.n = 10, .m = 40});
  DualQp qp(10, 40);
  qp.limit_iterations(2);
  EXPECT_EQ(qp.solve(p.view()), Outcome::too_many_iterations);
  qp.limit_iterations(0);
  EXPECT_EQ(qp.solve(p.view()), Outcome::solved);
}

TEST(DualQp, MeetsTheConditionsOfOptimalityOnThousandsOfProblems) {
  std::mt19937 random(1);
  DualQp qp(40, 90);
  int solved = 0, with_many_active = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    Shape shape;
    shape.n = 1 + trial % 37;
    shape.m = (trial * 7) % 80;
    shape.equalities = std::min({trial % 5 == 0 ? trial % 7 : 0, shape.m, shape.n});
    shape.bounds = trial % 2 == 0;
    shape.dependent = trial % 3 == 0;
    const OwnProblem p = random_problem(random, shape);
    ASSERT_EQ(qp.solve(p.view(), trial % 4 == 0 ? Start::cold : Start::warm), Outcome::solved)
        << trial << " row " << qp.violated_row() << " of " << shape.m;
    const Kkt result = kkt(p, qp);
    EXPECT_LE(result.violation, 1e-9) << trial;
    EXPECT_LE(result.worst(), 1e-8) << trial;
    ++solved;
    with_many_active += qp.active_rows().size() > 10 ? 1 : 0;
  }
  EXPECT_EQ(solved, 4000);
  EXPECT_GT(with_many_active, 1000);
}

TEST(DualQp, WarmAndColdStartsAgree) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  for (const bool dependent : {false, true}) {
    OwnProblem p = random_problem(
        random, {.n = 20, .m = 50, .equalities = 3, .bounds = true, .dependent = dependent});
    DualQp warm(20, 50), cold(20, 50);
    ASSERT_EQ(warm.solve(p.view()), Outcome::solved);
    int warm_iterations = 0, cold_iterations = 0;
    for (int tick = 0; tick < 300; ++tick) {
      for (double& g : p.g) g += 0.05 * normal(random);
      if (tick % 50 == 49) p.g *= -1.0;  // a jump
      ASSERT_EQ(warm.solve(p.view()), Outcome::solved) << tick;
      ASSERT_EQ(cold.solve(p.view(), Start::cold), Outcome::solved) << tick;
      EXPECT_NEAR((warm.x() - cold.x()).cwiseAbs().maxCoeff(), 0.0, 1e-9) << tick;
      EXPECT_LE(kkt(p, warm).worst(), 1e-9);
      warm_iterations += warm.iterations();
      cold_iterations += cold.iterations();
    }
    EXPECT_LT(warm_iterations * 4, cold_iterations);
  }
}

TEST(DualQp, NeverTakesAnInfeasibleProblemForASolvedOne) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform;
  DualQp qp(30, 70);
  for (int trial = 0; trial < 1000; ++trial) {
    Shape shape{.n = 2 + trial % 29, .m = 3 + trial % 60, .bounds = trial % 2 == 0};
    OwnProblem p = random_problem(random, shape);
    ASSERT_EQ(qp.solve(p.view()), Outcome::solved);
    const Eigen::VectorXd before = qp.x();
    // A row that is a positive sum of rows at their upper bounds and must be greater than that sum.
    const int parts = 1 + trial % std::min(3, shape.m - 1), last = shape.m - 1;
    p.A.row(last).setZero();
    double most = 0.0;
    for (int i = 0; i < parts; ++i) {
      const double share = 0.1 + uniform(random);
      if (p.upper[i] == kInf) p.upper[i] = p.lower[i] + 1.0;
      p.A.row(last) += share * p.A.row(i);
      most += share * p.upper[i];
    }
    p.lower[last] = most + 1e-6;
    p.upper[last] = kInf;
    EXPECT_EQ(qp.solve(p.view()), Outcome::infeasible) << trial;
    EXPECT_GE(qp.violated_row(), 0);
    EXPECT_EQ(Eigen::VectorXd(qp.x()), before);
    p.lower[last] = p.A.row(last).dot(p.inside);
    EXPECT_EQ(qp.solve(p.view()), Outcome::solved) << trial;
  }
}

TEST(DualQp, DoesNotAllocateAndIsDeterministic) {
  std::mt19937 random(4);
  const OwnProblem small = random_problem(random, {.n = 9, .m = 20, .bounds = true});
  const OwnProblem large =
      random_problem(random, {.n = 36, .m = 74, .equalities = 4, .bounds = true});
  DualQp qp(36, 74), again(36, 74);
  const Problem small_view = small.view(), large_view = large.view();
  Eigen::VectorXd x(36);
  {
    testing::NoMalloc guard;
    for (int i = 0; i < 3; ++i) {
      ASSERT_EQ(qp.solve(large_view), Outcome::solved);
      ASSERT_EQ(qp.solve(large_view, Start::cold), Outcome::solved);
      x = qp.x();
      ASSERT_EQ(qp.solve(small_view, Start::cold), Outcome::solved);
    }
  }
  ASSERT_EQ(again.solve(large_view, Start::cold), Outcome::solved);
  EXPECT_EQ(Eigen::VectorXd(again.x()), x);  // independent of earlier problems
  DualQp tiny(1, 0);
  ASSERT_EQ(tiny.solve(large_view, Start::cold), Outcome::solved);  // grows
  EXPECT_EQ(Eigen::VectorXd(tiny.x()), x);
}

}  // namespace
}  // namespace mimesis::qp
