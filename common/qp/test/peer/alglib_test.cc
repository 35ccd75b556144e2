#include <gtest/gtest.h>

#include "common/qp/test/peer/alglib_qp.h"
#include "common/qp/test/random_problems.h"

namespace mimesis::qp {
namespace {

double violation(const OwnProblem& p, const Eigen::VectorXd& x) {
  const Eigen::VectorXd value = p.A * x;
  double worst = std::max({0.0, (p.lower - value).maxCoeff(), (value - p.upper).maxCoeff()});
  if (p.x_lower.size() > 0) {
    worst = std::max({worst, (p.x_lower - x).maxCoeff(), (x - p.x_upper).maxCoeff()});
  }
  return worst;
}

TEST(DualQp, AgreesWithAnInteriorPointMethod) {
  std::mt19937 random(11);
  DualQp qp(36, 74);
  int compared = 0;
  for (int trial = 0; trial < 300; ++trial) {
    Shape shape{.n = 2 + trial % 35, .m = 1 + (trial * 7) % 74, .conditioning = 10.0};
    shape.equalities = trial % 5 == 0 ? std::min(shape.m, shape.n / 3) : 0;
    shape.bounds = trial % 2 == 0;
    const OwnProblem p = random_problem(random, shape);
    ASSERT_EQ(qp.solve(p.view()), Outcome::solved) << trial;
    EXPECT_LE(violation(p, qp.x()), 1e-9) << trial;
    const Eigen::VectorXd peer = alglib_minimum(p.view());
    if (peer.size() == 0) continue;
    const double theirs = 0.5 * peer.dot(p.H * peer) + p.g.dot(peer);
    // Gain that the peer's own violation may have brought.
    double slack = 0.0;
    for (const double lambda : qp.multipliers()) slack += std::abs(lambda) * violation(p, peer);
    const double ours = 0.5 * qp.x().dot(p.H * qp.x()) + p.g.dot(qp.x());
    EXPECT_NEAR(ours, theirs, 1e-8 * (1.0 + std::abs(theirs)) + slack) << trial;
    ++compared;
  }
  EXPECT_GE(compared, 290);
}

}  // namespace
}  // namespace mimesis::qp
