// What limits of joints and legs leave of the goals.
#include "common/math/so3.h"
#include "nodes/walker/tasks/leg_room.h"
#include "nodes/walker/tasks/limits.h"
#include "nodes/walker/tasks/stack.h"
#include "nodes/walker/tasks/test/stack_trial.h"

namespace mimesis::walker {
namespace {

TEST(Stack, KeepsTheUpperBodyWithinItsLimitsAndTheFeetWhereTheyAre) {
  for (const robot::Biped& biped : robots()) {
    const Trial strain = trial_of(biped, 6.0, [](const Reference& r, double t) {
      TaskGoals goals = r.walk(t, 0.2);
      goals.upper_body.array() += t < 3.0 ? 2.5 : -2.5;  // far beyond the limits, with jumps
      return goals;
    });
    expect_exact(strain, biped.tree.name(), 5e-6);
    expect_within_limits(strain, biped.tree.name());
    EXPECT_NEAR(strain.closest_rad, 0.005, 1e-6) << biped.tree.name();  // up to the margin
    EXPECT_NEAR(strain.fastest, 0.98, 1e-6) << biped.tree.name();
  }
}

TEST(Stack, StopsBeforeTheStretchedLegAndComesBack) {
  for (const robot::Biped& biped : robots()) {
    // Higher than the legs are long, for two seconds.
    const Goals high = [](const Reference& r, double t) {
      TaskGoals goals = r.stand();
      const auto up = Reference::ramp(t, 0.0, 1.0), down = Reference::ramp(t, 3.0, 4.0);
      goals.com_W_m.z() += 0.2 * (up.value - down.value);
      goals.com_v_W.z() = 0.2 * (up.rate - down.rate);
      return goals;
    };
    const Trial up = trial_of(biped, 2.9, high);
    expect_within_limits(up, biped.tree.name());
    EXPECT_GT(up.limited, 200) << biped.tree.name();
    EXPECT_TRUE(up.state.limited);
    // The height gives way, the feet nearly not.
    EXPECT_GT(up.last_com_error_m, 0.05) << biped.tree.name();
    EXPECT_LT(up.foot_error_m, 0.02 * up.com_error_m) << biped.tree.name();
    const LegRoom legs(biped);
    for (const Side side : robot::kSides) {
      const double knee = up.state.q[biped.leg[side].dof[3]];
      EXPECT_NEAR(std::abs(knee - legs.straight_rad(side)), 0.02, 1e-3) << biped.tree.name();
    }
    // Arms and trunk are no help, and nothing moves while nothing is wished.
    EXPECT_LT(up.state.dq.cwiseAbs().maxCoeff(), 1e-3) << biped.tree.name();
    for (const int dof : biped.upper_body) {
      EXPECT_NEAR(up.state.q[dof], biped.half_sitting[dof], 0.05) << biped.tree.moved(dof).joint;
    }
    EXPECT_LT(up.sharpest_rad_s, 4.0) << biped.tree.name();
    const Trial back = trial_of(biped, 6.0, high);
    expect_within_limits(back, biped.tree.name());
    EXPECT_LT(back.sharpest_rad_s, 4.0) << biped.tree.name();
    EXPECT_FALSE(back.state.limited);
    EXPECT_LT(back.last_com_error_m, 1e-6) << biped.tree.name();
    EXPECT_LT(back.last_foot_error_m, 1e-6) << biped.tree.name();
    EXPECT_LT((back.state.q - biped.half_sitting).cwiseAbs().maxCoeff(), 1e-3) << biped.tree.name();
  }
}

TEST(Stack, ArmsStayWhereTheyAreWhileALongStepStretchesALeg) {
  const robot::Biped biped = model::load_biped("biped.yaml");
  const Trial fast =
      trial_of(biped, 8.0, [](const Reference& r, double t) { return r.walk(t, 0.5); });
  expect_within_limits(fast, "fast");
  EXPECT_LT(fast.com_error_m, 1e-4);
  EXPECT_LT(fast.foot_error_m, 1e-3);
  EXPECT_LT(fast.sharpest_rad_s, 4.0);
}

TEST(Stack, AGoalThatJumpsIsApproachedInSteps) {
  const robot::Biped biped = model::load_biped("biped.yaml");
  // In one tick: up to 4 mm at once, of more than that 4 mm or a tenth.
  for (const auto& [jump_m, left_m] : {std::pair{0.003, 0.0}, {0.015, 0.011}, {0.1, 0.09}}) {
    Stack stack(biped, walking_stack(biped));
    TaskGoals goals = Reference(biped).stand();
    goals.com_W_m.x() += jump_m;
    EXPECT_NEAR(stack.step(goals, kDt).com_error_m, left_m, 1e-4) << jump_m;
  }
}

TEST(Stack, StaysWithinLimitsWhateverTheGoal) {
  for (const robot::Biped& biped : robots()) {
    const Trial absurd = trial_of(biped, 8.0, [](const Reference& r, double t) {
      TaskGoals goals = r.stand();
      if (t > 3.0) return goals;
      goals.foot[0].X_WS.translation() += Eigen::Vector3d(1.5, 0.4, 0.5);
      goals.foot[1].X_WS.linear() = math::exp_so3({0.0, 2.0, 1.0});
      goals.com_W_m = {1e3, -1e150, 2.0};
      goals.R_W_trunk = math::exp_so3({3.0, 0.0, 0.0});
      goals.hand[0] = {.p_W_m = {5.0, 5.0, 5.0}, .share = 7.0};
      return goals;
    });
    expect_within_limits(absurd, biped.tree.name());
    EXPECT_GT(absurd.limited, 100) << biped.tree.name();
    EXPECT_LT(absurd.last_com_error_m, 1e-6) << biped.tree.name();  // back at what it can do
    EXPECT_LT(absurd.last_foot_error_m, 1e-6) << biped.tree.name();
  }
}

/// A foot that is called where its leg does not reach: Newton's method finds no rest there, the
/// joints do. 100 rad/s², but for what limits ask for.
TEST(Stack, JointsChangeTheirSpeedsSlowlyWhileALimitKeepsAFootFromItsGoal) {
  constexpr double kMost_rad_s = 100.0 * kDt;
  const robot::Biped biped = model::load_biped("biped.yaml");
  const Reference reference(biped);
  Stack stack(biped, walking_stack(biped));
  const Limits limits(biped, walking_stack(biped));
  const Eigen::Index dof = biped.tree.dof();
  Eigen::VectorXd q = biped.half_sitting, dq = Eigen::VectorXd::Zero(dof), lower(6 + dof),
                  upper(6 + dof);
  double most_rad_s = 0.0;
  int kept = 0;
  for (double t = kDt; t < 4.0; t += kDt) {
    TaskGoals goals = reference.stand();
    goals.foot[kLeft].X_WS.translation() +=
        Reference::ramp(t, 0.0, 1.0).value * Eigen::Vector3d(0.8, 0.1, 0.3);
    limits.bounds(q, kDt, lower, upper);
    const bool was_kept = stack.state().limited;
    const StackState& state = stack.step(goals, kDt);
    ASSERT_EQ(state.reason, "");
    for (Eigen::Index i = 0; was_kept && i < dof; ++i) {
      const double way = state.dq[i] * kDt;
      if (way < lower[6 + i] + 1e-9 || way > upper[6 + i] - 1e-9) continue;  // at its limit
      most_rad_s = std::max(most_rad_s, std::abs(state.dq[i] - dq[i]));
      ++kept;
    }
    q = state.q;
    dq = state.dq;
  }
  EXPECT_NEAR(most_rad_s, kMost_rad_s, 1e-6);
  EXPECT_GT(kept, 1000);
}

TEST(Stack, BringsJointsBackFromBeyondTheirLimits) {
  const robot::Biped biped = model::load_biped("biped.yaml");
  const int elbow = biped.tree.require_joint("left_elbow");
  Eigen::VectorXd q = biped.half_sitting;
  q[elbow] = biped.tree.upper()[elbow] + 0.1;
  Stack stack(biped, walking_stack(biped));
  stack.reset(biped.X_WB_half_sitting, q);
  TaskGoals goals = Reference(biped).stand();
  double before = q[elbow];
  for (int tick = 0; tick < 100; ++tick) {
    const StackState& state = stack.step(goals, kDt);
    EXPECT_EQ(state.reason, "");
    EXPECT_LE(state.q[elbow], before);
    before = state.q[elbow];
  }
  EXPECT_LE(before, biped.tree.upper()[elbow]);
}

}  // namespace
}  // namespace mimesis::walker
