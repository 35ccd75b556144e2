#include "nodes/walker/tasks/cascade.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include "common/testing/no_malloc.h"

namespace mimesis::walker {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

constexpr double kInf = std::numeric_limits<double>::infinity();

/// Tasks of a cascade as matrices.
struct Tasks {
  std::vector<MatrixXd> A;
  std::vector<VectorXd> b;
  VectorXd lower, upper;

  int n() const { return static_cast<int>(lower.size()); }
  VectorXd all_b() const {
    VectorXd all;
    for (const VectorXd& part : b) {
      all.conservativeResize(all.size() + part.size());
      all.tail(part.size()) = part;
    }
    return all;
  }
  void fill(Cascade& cascade) const {
    cascade.clear();
    for (const MatrixXd& level : A) {
      cascade.begin_level();
      for (Eigen::Index i = 0; i < level.rows(); ++i) cascade.add_row(level.row(i), 1.0);
    }
  }
};

constexpr double kTickStep = 0.02;  // about what joints move within a tick [rad]

Tasks random_tasks(std::mt19937& random, int n, const std::vector<int>& rows, double room) {
  std::normal_distribution<double> normal;
  const auto matrix = [&](int m, int k) {
    return MatrixXd(MatrixXd::NullaryExpr(m, k, [&] { return normal(random); }));
  };
  Tasks tasks;
  for (const int m : rows) {
    tasks.A.push_back(matrix(m, n));
    tasks.b.push_back(kTickStep * matrix(m, 1));
  }
  tasks.lower = -kTickStep * room * matrix(n, 1).cwiseAbs();
  tasks.upper = kTickStep * room * matrix(n, 1).cwiseAbs();
  return tasks;
}

/// Reference optimum, found level by level in the full space: every level is a quadratic program
/// with the values that the levels above have reached as equalities. Squares are made definite by
/// 1e-10, so the accuracy is limited.
std::vector<VectorXd> values_by_equalities(const Tasks& tasks) {
  const int n = tasks.n();
  std::vector<VectorXd> values;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> above(0, n);
  VectorXd reached;
  for (std::size_t k = 0; k < tasks.A.size(); ++k) {
    const MatrixXd H = tasks.A[k].transpose() * tasks.A[k] + 1e-10 * MatrixXd::Identity(n, n);
    const VectorXd g = -tasks.A[k].transpose() * tasks.b[k];
    const VectorXd low = reached.array() - 1e-9, high = reached.array() + 1e-9;
    qp::DualQp qp(n, 200);
    const auto outcome = qp.solve({H, g, above, low, high, tasks.lower, tasks.upper});
    EXPECT_EQ(outcome, qp::Outcome::solved) << k;
    values.push_back(tasks.A[k] * VectorXd(qp.x()));
    above.conservativeResize(above.rows() + tasks.A[k].rows(), n);
    above.bottomRows(tasks.A[k].rows()) = tasks.A[k];
    reached.conservativeResize(above.rows());
    reached.tail(values.back().size()) = values.back();
  }
  return values;
}

TEST(Cascade, WithoutBoundsIsThatOfTheNullSpaceProjections) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const Tasks tasks = random_tasks(random, 20, {6, 3, 5}, kInf);
    Cascade cascade(20, 14, 3, 1e-3);
    tasks.fill(cascade);
    EXPECT_EQ(cascade.free(), 6);
    VectorXd x(20);
    ASSERT_TRUE(cascade.solve(tasks.all_b(), tasks.lower, tasks.upper, x));
    EXPECT_FALSE(cascade.bounded());
    // All levels fit: the smallest x of all that fulfil them.
    MatrixXd A(14, 20);
    A << tasks.A[0], tasks.A[1], tasks.A[2];
    const VectorXd smallest = A.transpose() * (A * A.transpose()).llt().solve(tasks.all_b());
    EXPECT_NEAR((x - smallest).norm(), 0.0, 1e-10);
    EXPECT_LT(cascade.first_residual(), 1e-12);
  }
}

TEST(Cascade, AConflictIsTheLowerTasksLoss) {
  // x₀ = 1, then x₀ + x₁ = 3 and x₀ − x₁ = 4 within a level, weights 1 and 4; x₀ = 7 comes last.
  Cascade cascade(2, 4, 3, 1e-3);
  cascade.clear();
  cascade.begin_level();
  cascade.add_axis(0, 1.0);
  cascade.begin_level();
  cascade.add_row(Eigen::RowVector2d(1.0, 1.0), 1.0);
  cascade.add_row(Eigen::RowVector2d(1.0, -1.0), 4.0);
  cascade.begin_level();
  cascade.add_axis(0, 1.0);
  const Eigen::Vector2d none = Eigen::Vector2d::Constant(kInf);
  Eigen::VectorXd x(2);
  ASSERT_TRUE(cascade.solve(Eigen::Vector4d(1.0, 3.0, 4.0, 7.0), -none, none, x));
  EXPECT_NEAR(x[0], 1.0, 1e-12);
  // (x₁ − 2)² + 4 (x₁ + 3)² is least at −2.
  EXPECT_NEAR(x[1], -2.0, 1e-12);
}

TEST(Cascade, UnderBoundsIsTheLexicographicOptimum) {
  std::mt19937 random(2);
  int bounded = 0, first_level_lost = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const double room = trial % 2 == 0 ? 0.4 : 1.2;
    const Tasks tasks = random_tasks(random, 12, {3, 2, 4}, room);
    Cascade cascade(12, 9, 3, 1e-3);
    tasks.fill(cascade);
    VectorXd x(12);
    ASSERT_TRUE(cascade.solve(tasks.all_b(), tasks.lower, tasks.upper, x)) << trial;
    EXPECT_LE((x - tasks.upper).maxCoeff(), 0.0);
    EXPECT_LE((tasks.lower - x).maxCoeff(), 0.0);
    bounded += cascade.bounded();
    first_level_lost += cascade.first_residual() > 1e-3 * kTickStep;
    const auto expected = values_by_equalities(tasks);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR((tasks.A[k] * x - expected[k]).cwiseAbs().maxCoeff(), 0.0, 5e-6)
          << trial << " level " << k;
    }
  }
  EXPECT_GT(bounded, 300);
  EXPECT_GT(first_level_lost, 30);
}

TEST(Cascade, ALowerLevelNeverDisturbsAHigherOne) {
  std::mt19937 random(3);
  int bounded = 0;
  for (int trial = 0; trial < 400; ++trial) {
    Tasks tasks = random_tasks(random, 16, {4, 3, 5, 4}, trial % 2 == 0 ? 0.5 : 2.0);
    if (trial % 5 == 0) tasks.A[2].row(1) = tasks.A[0].row(0) + tasks.A[1].row(2);  // in conflict
    if (trial % 7 == 0) tasks.A[1].row(0) = tasks.A[1].row(1);
    Cascade cascade(16, 16, 4, 1e-3);
    VectorXd x(16), with_more(16);
    for (std::size_t levels = 1; levels <= 4; ++levels) {
      Tasks some = tasks;
      some.A.resize(levels);
      some.b.resize(levels);
      some.fill(cascade);
      ASSERT_TRUE(cascade.solve(some.all_b(), tasks.lower, tasks.upper, with_more));
      for (std::size_t k = 0; k + 1 < levels; ++k) {
        EXPECT_NEAR((tasks.A[k] * (with_more - x)).cwiseAbs().maxCoeff(), 0.0, 1e-9)
            << trial << ": level " << levels - 1 << " disturbs " << k;
      }
      bounded += cascade.bounded();
      x = with_more;
    }
  }
  EXPECT_GT(bounded, 800);
}

TEST(Cascade, FindsASolutionWhereUpperLevelsLeaveNoRoom) {
  // More variables are held by their bounds than lower levels have left to decide: these hold only
  // as exactly as the upper levels' solutions are.
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int trial = 0; trial < 400; ++trial) {
    Tasks tasks = random_tasks(random, 12, {5, 4, 3}, 1.0);
    for (Eigen::Index i = 0; i < 12; ++i) {
      if (i % 12 < 4 + trial % 9) tasks.lower[i] = tasks.upper[i] = kTickStep * uniform(random);
    }
    Cascade cascade(12, 12, 3, 1e-3);
    tasks.fill(cascade);
    VectorXd x(12);
    ASSERT_TRUE(cascade.solve(tasks.all_b(), tasks.lower, tasks.upper, x))
        << trial << ' ' << qp::name(cascade.outcome());
    EXPECT_LT((x - tasks.upper).maxCoeff(), 1e-9);
    EXPECT_LT((tasks.lower - x).maxCoeff(), 1e-9);
  }
}

TEST(Cascade, IsDampedNextToASingularity) {
  // Two rows that nearly coincide and contradict each other.
  const double angle = 1e-4;
  Cascade cascade(2, 2, 1, 1e-3);
  cascade.clear();
  cascade.begin_level();
  cascade.add_row(Eigen::RowVector2d(1.0, 0.0), 1.0);
  cascade.add_row(Eigen::RowVector2d(std::cos(angle), std::sin(angle)), 1.0);
  const Eigen::Vector2d none = Eigen::Vector2d::Constant(kInf);
  VectorXd x(2);
  ASSERT_TRUE(cascade.solve(Eigen::Vector2d(0.0, 0.01), -none, none, x));
  EXPECT_LT(x.norm(), 2.0);  // undamped: 100
  EXPECT_NEAR(x[0], 0.005, 1e-4);
}

TEST(Cascade, DoesNotAllocateAndIsDeterministic) {
  std::mt19937 random(4);
  const Tasks tasks = random_tasks(random, 36, {15, 3, 18}, 0.3);
  Cascade cascade(36, 36, 3, 1e-3), again(36, 36, 3, 1e-3);
  const VectorXd b = tasks.all_b();
  VectorXd x(36), y(36);
  {
    mimesis::testing::NoMalloc guard;
    for (int i = 0; i < 3; ++i) {
      tasks.fill(cascade);
      ASSERT_TRUE(cascade.solve(b, tasks.lower, tasks.upper, x));
    }
  }
  EXPECT_TRUE(cascade.bounded());
  for (int i = 0; i < 3; ++i) {
    tasks.fill(again);
    ASSERT_TRUE(again.solve(b, tasks.lower, tasks.upper, y));
  }
  EXPECT_EQ(x, y);
}

}  // namespace
}  // namespace mimesis::walker
