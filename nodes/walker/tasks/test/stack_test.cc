#include "nodes/walker/tasks/stack.h"

#include "common/math/so3.h"
#include "common/testing/no_malloc.h"
#include "nodes/walker/tasks/test/stack_trial.h"

namespace mimesis::walker {
namespace {

TEST(Stack, FollowsAWalk) {
  for (const robot::Biped& biped : robots()) {
    for (const double speed : {0.0, 0.2, 0.3, -0.2}) {
      const Trial walk =
          trial_of(biped, 8.0, [&](const Reference& r, double t) { return r.walk(t, speed); });
      const std::string what = biped.tree.name() + " at " + std::to_string(speed);
      expect_exact(walk, what);
      expect_within_limits(walk, what);
    }
  }
}

TEST(Stack, SquatsAndTwists) {
  for (const robot::Biped& biped : robots()) {
    const Trial squat =
        trial_of(biped, 6.0, [](const Reference& r, double t) { return r.squat(t, 0.15); });
    expect_exact(squat, biped.tree.name());
    expect_within_limits(squat, biped.tree.name());
    // The trunk turns and bends above standing feet, ends at rest.
    const Eigen::Vector3d turn(0.05, 0.2, 0.3);
    const Trial twist = trial_of(biped, 3.0, [&](const Reference& r, double t) {
      TaskGoals goals = r.stand();
      const double share = Reference::ramp(t, 0.0, 1.5).value;
      goals.R_W_trunk = math::exp_so3(share * turn) * goals.R_W_trunk;
      return goals;
    });
    expect_exact(twist, biped.tree.name());
    robot::Kinematics kinematics(biped.tree);
    kinematics.update(twist.state.X_WB, twist.state.q);
    const Eigen::Matrix3d R = kinematics.X_WL(biped.trunk).linear();
    EXPECT_LT(math::log_so3(R.transpose() * math::exp_so3(turn)).norm(), 1e-6) << biped.tree.name();
  }
}

TEST(Stack, FollowsAMovingTrunkGoalWithoutLag) {
  for (const robot::Biped& biped : robots()) {
    const Reference reference(biped);
    Stack stack(biped, walking_stack(biped));
    robot::Kinematics kinematics(biped.tree);
    double worst_rad = 0.0;
    for (double t = kDt; t < 3.0; t += kDt) {
      TaskGoals goals = reference.stand();
      const double turn = 0.2 * (1.0 - std::cos(3.0 * t));  // up to 0.6 rad/s
      goals.R_W_trunk = math::exp_so3({0.0, 0.0, turn}) * goals.R_W_trunk;
      const StackState& state = stack.step(goals, kDt);
      kinematics.update(state.X_WB, state.q);
      const Eigen::Matrix3d R = kinematics.X_WL(biped.trunk).linear();
      worst_rad = std::max(worst_rad, math::log_so3(R.transpose() * goals.R_W_trunk).norm());
    }
    EXPECT_LT(worst_rad, 2e-3) << biped.tree.name();  // rate / gain, 0.012, without the goal's rate
  }
}

TEST(Stack, ALowerTaskNeverMovesFeetAndCom) {
  const robot::Biped biped = model::load_biped("biped.yaml");
  const Trial torn = trial_of(biped, 5.0, [](const Reference& r, double t) {
    TaskGoals goals = r.walk(t, 0.2);
    goals.R_W_trunk = math::exp_so3({0.3 * std::sin(5.0 * t), 1.0, 0.0});
    for (TaskGoals::Hand& hand : goals.hand) {
      hand = {.p_W_m = goals.com_W_m + Eigen::Vector3d(0.8, 0.6 * std::sin(3.0 * t), -0.5),
              .share = 1.0};
    }
    return goals;
  });
  expect_within_limits(torn, "torn");
  expect_exact(torn, "torn", 1e-4);
}

TEST(Stack, StaysWithItsLastPostureIfAGoalIsNoNumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const robot::Biped biped = model::load_biped("biped.yaml");
  const Reference reference(biped);
  Stack stack(biped, walking_stack(biped));
  for (int tick = 1; tick < 200; ++tick) stack.step(reference.walk(tick * kDt, 0.2), kDt);
  const Eigen::VectorXd q = stack.state().q;
  const auto refused = [&](auto change, const std::string& reason, double dt_s = kDt) {
    TaskGoals bad = reference.walk(1.0, 0.2);
    change(bad);
    const StackState& state = stack.step(bad, dt_s);
    EXPECT_EQ(state.reason, "stack of tasks: " + reason);
    EXPECT_EQ(state.q, q);
    EXPECT_EQ(state.dq.norm(), 0.0);
  };
  refused([&](TaskGoals& g) { g.com_W_m.x() = nan; }, "the CoM's goal is no number");
  refused([&](TaskGoals& g) { g.com_v_W.z() = nan; }, "the CoM's goal is no number");
  refused([&](TaskGoals& g) { g.foot[1].X_WS(0, 0) = nan; }, "a foot's goal is no number");
  refused([&](TaskGoals& g) { g.foot[0].yaw_rate_rad_s = INFINITY; }, "a foot's goal is no number");
  refused([&](TaskGoals& g) { g.R_W_trunk(2, 1) = nan; }, "the trunk's goal is no number");
  refused([&](TaskGoals& g) { g.upper_body[3] = nan; }, "the upper body's goal is no number");
  refused([&](TaskGoals& g) { g.upper_body.resize(2); },
          "the upper body's goal is of another size");
  refused([&](TaskGoals& g) { g.upper_body_rate.resize(2); },
          "the upper body's rate is of another size");
  refused([&](TaskGoals& g) { g.hand[0].share = nan; }, "a hand's goal is no number");
  refused([](TaskGoals&) {}, "dt is no time between 0 and 0.1 s", nan);
  refused([](TaskGoals&) {}, "dt is no time between 0 and 0.1 s", 0.0);
  const StackState& on = stack.step(reference.walk(1.0, 0.2), kDt);
  EXPECT_EQ(on.reason, "");
  EXPECT_LT(on.foot_error_m, 1e-6);
}

TEST(Stack, DoesNotAllocateAndIsDeterministic) {
  const robot::Biped biped = model::load_biped("biped.yaml");
  const Reference reference(biped);
  Stack stack(biped, walking_stack(biped)), again(biped, walking_stack(biped));
  std::vector<TaskGoals> goals;
  for (int tick = 1; tick <= 400; ++tick) {
    goals.push_back(reference.walk(tick * kDt, 0.3));
    if (tick > 200) {
      goals.back().com_W_m.z() += 0.1;  // limits
      goals.back().upper_body.array() += 2.0;
      goals.back().hand[0].share = 0.5;
    }
    if (tick == 300) goals.back().com_W_m.z() = NAN;
  }
  {
    testing::NoMalloc guard;
    for (const TaskGoals& goal : goals) stack.step(goal, kDt);
  }
  for (const TaskGoals& goal : goals) again.step(goal, kDt);
  EXPECT_EQ(stack.state().q, again.state().q);
  EXPECT_EQ(stack.state().X_WB.matrix(), again.state().X_WB.matrix());
}

TEST(Stack, APostureTaskTakesLegsToHalfSitting) {
  const robot::Biped biped = model::load_biped("biped.yaml");
  StackSettings settings;
  settings.tasks = {
      {.name = "some", .kind = TaskKind::kPosture, .joints = {"left_knee", "left_elbow"}}};
  Stack stack(biped, settings);
  const int knee = biped.tree.require_joint("left_knee"),
            elbow = biped.tree.require_joint("left_elbow");
  Eigen::VectorXd q = biped.half_sitting;
  q[knee] += 0.2;
  stack.reset(biped.X_WB_half_sitting, q);
  TaskGoals goals = Reference(biped).stand();
  const auto at = std::ranges::find(biped.upper_body, elbow) - biped.upper_body.begin();
  goals.upper_body[at] -= 0.3;
  for (int tick = 0; tick < 200; ++tick) stack.step(goals, kDt);
  EXPECT_NEAR(stack.state().q[knee], biped.half_sitting[knee], 1e-3);
  EXPECT_NEAR(stack.state().q[elbow], biped.half_sitting[elbow] - 0.3, 1e-3);
}

}  // namespace
}  // namespace mimesis::walker
