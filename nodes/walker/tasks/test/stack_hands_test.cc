// Hands that reach while the robot walks.
#include "nodes/walker/tasks/stack.h"
#include "nodes/walker/tasks/test/stack_trial.h"

namespace mimesis::walker {
namespace {

TEST(Stack, HandsComeInGradually) {
  for (const robot::Biped& biped : robots()) {
    if (biped.hand[kRight] < 0) continue;
    // The left hand pulls with its whole share; the right one is far from what it shall take.
    const auto reach = [&](const Reference& r, double t, double share) {
      TaskGoals goals = r.walk(t, 0.0);
      goals.hand[kLeft].p_W_m += Eigen::Vector3d(0.12, 0.05, 0.15);
      goals.hand[kLeft].share = Reference::ramp(t, 0.5, 1.5).value;
      goals.hand[kRight].p_W_m += Eigen::Vector3d(0.2, 0.1, 0.3);
      goals.hand[kRight].share = t > 3.0 ? share : 0.0;
      return goals;
    };
    const auto speed = [&](double share) -> Eigen::VectorXd {
      return trial_of(biped, 3.0 + 1.5 * kDt,
                      [&](const Reference& r, double t) { return reach(r, t, share); })
          .state.dq;
    };
    const Eigen::VectorXd without = speed(0.0);
    const double thousandth = (speed(1e-3) - without).cwiseAbs().maxCoeff();
    EXPECT_GT(thousandth, 0.0) << biped.tree.name();
    EXPECT_LT(thousandth, 0.05) << biped.tree.name();
    EXPECT_NEAR((speed(1e-4) - without).cwiseAbs().maxCoeff(), 0.1 * thousandth, 0.02 * thousandth)
        << biped.tree.name();
  }
}

TEST(Stack, ReachesWithAHandWhileAFootMoves) {
  for (const robot::Biped& biped : robots()) {
    if (biped.hand[kRight] < 0) continue;
    const auto reach = [&](const Reference& r, double t) {
      TaskGoals goals = r.walk(t, 0.0);
      TaskGoals::Hand& hand = goals.hand[kRight];
      hand.p_W_m += Eigen::Vector3d(0.12, -0.05, 0.15);
      hand.share = Reference::ramp(t, 0.5, 1.5).value - Reference::ramp(t, 4.0, 5.0).value;
      return goals;
    };
    const Trial there = trial_of(biped, 3.5, reach);
    expect_exact(there, biped.tree.name());
    expect_within_limits(there, biped.tree.name());
    EXPECT_LT(there.sharpest_rad_s, 1.0) << biped.tree.name();
    robot::Kinematics kinematics(biped.tree);
    kinematics.update(there.state.X_WB, there.state.q);
    const Eigen::Vector3d wished = reach(Reference(biped), 3.5).hand[kRight].p_W_m;
    EXPECT_LT((kinematics.X_WL(biped.hand[kRight]).translation() - wished).norm(), 1e-3)
        << biped.tree.name();
    // And back to the posture when the hand is let go.
    const Trial back = trial_of(biped, 8.0, reach);
    EXPECT_LT(back.sharpest_rad_s, 1.0) << biped.tree.name();
    for (const int dof : biped.upper_body) {
      EXPECT_NEAR(back.state.q[dof], biped.half_sitting[dof], 1e-6) << biped.tree.moved(dof).joint;
    }
  }
}

}  // namespace
}  // namespace mimesis::walker
