#include "nodes/walker/tasks/stack.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "common/math/so3.h"
#include "common/testing/no_malloc.h"
#include "nodes/walker/tasks/limits.h"
#include "nodes/walker/tasks/test/reference.h"

namespace mimesis::walker {
namespace {

constexpr double kDt = 0.005;
using Goals = std::function<TaskGoals(const Reference&, double t)>;

/// Results of a run of a stack.
struct Trial {
  double com_error_m = 0.0, foot_error_m = 0.0;  ///< worst
  double last_com_error_m = 0.0, last_foot_error_m = 0.0;
  double fastest = 0.0;       ///< largest share of the speed limits [1]
  double closest_rad = 1e9;   ///< to a limit
  double sharpest_rad_s = 0;  ///< greatest change of a velocity within a tick
  int limited = 0, ticks = 0;
  StackState state;
};

Trial trial_of(const robot::Biped& biped, double seconds, const Goals& goals) {
  const Reference reference(biped);
  Stack stack(biped, walking_stack(biped));
  const Eigen::VectorXd lower = biped.tree.lower(), upper = biped.tree.upper(),
                        speed = biped.tree.max_speed();
  Trial trial;
  Eigen::VectorXd dq = Eigen::VectorXd::Zero(biped.tree.dof());
  for (double t = kDt; t < seconds; t += kDt) {
    const StackState& state = stack.step(goals(reference, t), kDt);
    EXPECT_EQ(state.reason, "");
    trial.com_error_m = std::max(trial.com_error_m, state.com_error_m);
    trial.foot_error_m = std::max(trial.foot_error_m, state.foot_error_m);
    trial.last_com_error_m = state.com_error_m;
    trial.last_foot_error_m = state.foot_error_m;
    for (Eigen::Index i = 0; i < dq.size(); ++i) {
      trial.fastest = std::max(trial.fastest, std::abs(state.dq[i]) / speed[i]);
      trial.closest_rad =
          std::min({trial.closest_rad, upper[i] - state.q[i], state.q[i] - lower[i]});
    }
    trial.sharpest_rad_s = std::max(trial.sharpest_rad_s, (state.dq - dq).cwiseAbs().maxCoeff());
    dq = state.dq;
    trial.limited += state.limited;
    ++trial.ticks;
  }
  trial.state = stack.state();
  return trial;
}

/// `within_m`: 1e-6 on smooth references; joints at their top speeds leave more to curvature.
void expect_exact(const Trial& trial, const std::string& what, double within_m = 1e-6) {
  EXPECT_LT(trial.com_error_m, within_m) << what;
  EXPECT_LT(trial.foot_error_m, within_m) << what;
  EXPECT_EQ(trial.limited, 0) << what;
}

/// Margins and speed limits of the settings.
void expect_within_limits(const Trial& trial, const std::string& what) {
  EXPECT_GE(trial.closest_rad, 0.005 - 1e-9) << what;
  EXPECT_LE(trial.fastest, 0.98 + 1e-9) << what;
}

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
    mimesis::testing::NoMalloc guard;
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
      {.name = "some", .kind = TaskKind::posture, .joints = {"left_knee", "left_elbow"}}};
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

// Hands that reach while the robot walks.
namespace {

TEST(Stack, HandsComeInGradually) {
  for (const robot::Biped& biped : robots()) {
    if (biped.hand[kRight] < 0) continue;
    // The left hand pulls with its whole share; the right one is far from its target.
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
    // The arm returns to the posture when the hand is released.
    const Trial back = trial_of(biped, 8.0, reach);
    EXPECT_LT(back.sharpest_rad_s, 1.0) << biped.tree.name();
    for (const int dof : biped.upper_body) {
      EXPECT_NEAR(back.state.q[dof], biped.half_sitting[dof], 1e-6) << biped.tree.moved(dof).joint;
    }
  }
}

}  // namespace

// Goals under limits of joints and legs.
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
    EXPECT_LT(absurd.last_com_error_m, 1e-6) << biped.tree.name();  // back within its limits
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

namespace {

constexpr double kKnee = 0.01;  // largest motion of the knees within a tick [rad]

/// A robot in half-sitting with its knees bent more or less by an angle.
class LegRoomTest : public ::testing::TestWithParam<robot::Biped> {
 protected:
  LegRoomTest() : kinematics(GetParam().tree), q(GetParam().half_sitting), room(GetParam()) {
    lower = upper = Eigen::VectorXd::Zero(6 + q.size());
    for (const Side side : robot::kSides) {
      lower[6 + knee(side)] = -kKnee;
      upper[6 + knee(side)] = kKnee;
    }
  }
  int knee(Side side) const { return GetParam().leg[side].dof[3]; }
  int link(Side side, std::size_t joint) const {
    const auto& tree = GetParam().tree;
    return tree.require_link(tree.moved(GetParam().leg[side].dof[joint]).name);
  }
  /// From the ankle to the hip, knees `more` rad nearer to stretched.
  Eigen::Vector3d way(Side side, double more) {
    Eigen::VectorXd posture = q;
    posture[knee(side)] += room.straight_rad(side) > q[knee(side)] ? more : -more;
    kinematics.update(Eigen::Isometry3d::Identity(), posture);
    const Eigen::Vector3d p =
        kinematics.X_WL(link(side, 2)).translation() - kinematics.X_WL(link(side, 4)).translation();
    kinematics.update(Eigen::Isometry3d::Identity(), q);
    return p;
  }
  /// Rise of a hip above its ankle until the leg is as long as with the knee `more` stretched.
  double rise_of(Side side, double more, const Eigen::Vector2d& along = Eigen::Vector2d::Zero()) {
    Eigen::Vector3d from = way(side, 0.0);
    from.head<2>() += along;
    const double length = way(side, more).norm();
    return std::sqrt(length * length - from.head<2>().squaredNorm()) - from.z();
  }
  double ask(const Eigen::Vector3d& com, const Eigen::Vector3d& feet = Eigen::Vector3d::Zero()) {
    kinematics.update(Eigen::Isometry3d::Identity(), q);
    return room.rise_m({.kinematics = kinematics,
                        .q = q,
                        .lower = lower,
                        .upper = upper,
                        .com_W_m = Eigen::Vector3d::Zero(),
                        .com_way_m = com,
                        .feet_way_m = {feet, feet},
                        .dt_s = kDt});
  }

  robot::Kinematics kinematics;
  Eigen::VectorXd q, lower, upper;
  LegRoom room;
};

TEST_P(LegRoomTest, PassesWhatTheKneesCan) {
  for (const double wished : {0.0, 1e-4, -1e-4, 3e-4}) {
    EXPECT_EQ(ask({1e-4, 2e-4, wished}), wished);
    EXPECT_EQ(room.missing_m(), 0.0);
  }
}

TEST_P(LegRoomTest, RisesAndFallsAsFarAsTheKneesMayGo) {
  const double most = std::min(rise_of(kLeft, 0.9 * kKnee), rise_of(kRight, 0.9 * kKnee)),
               least = std::max(rise_of(kLeft, -0.9 * kKnee), rise_of(kRight, -0.9 * kKnee));
  EXPECT_GT(most, 5e-4);
  EXPECT_NEAR(ask({0.0, 0.0, -1.0}), least, 1e-12);
  room.reset();
  EXPECT_NEAR(ask({0.0, 0.0, 1.0}), most, 1e-12);
  EXPECT_NEAR(room.missing_m(), 1.0 - most, 1e-12);
}

TEST_P(LegRoomTest, FeetAndTheWayOnTheGroundCount) {
  const Eigen::Vector2d along(0.004, 0.0);
  const double most =
      std::min(rise_of(kLeft, 0.9 * kKnee, along), rise_of(kRight, 0.9 * kKnee, along));
  EXPECT_NEAR(ask({along.x(), 0.0, 1.0}), most, 1e-12);
  room.reset();
  EXPECT_NEAR(ask({0.0, 0.0, 1.0}, {-along.x(), 0.0, 0.002}), most + 0.002, 1e-12);
}

TEST_P(LegRoomTest, AStretchedLegKeepsTheHeightAndBendsWithABoundedAcceleration) {
  for (const Side side : robot::kSides) {
    const double straight = room.straight_rad(side);
    q[knee(side)] = straight + std::copysign(0.02, q[knee(side)] - straight);
    lower[6 + knee(side)] = q[knee(side)] > straight ? 0.0 : -kKnee;  // no further
    upper[6 + knee(side)] = q[knee(side)] > straight ? kKnee : 0.0;
  }
  EXPECT_NEAR(ask({0.0, 0.0, 0.02}), 0.0, 1e-12);
  // 100 rad/s²: by 2.5 mrad in the first tick, by 5 mrad in the next one, and so on.
  for (int tick = 1; tick <= 3; ++tick) {
    const double bend = -100.0 * kDt * kDt * tick;
    const double least = std::max(rise_of(kLeft, bend), rise_of(kRight, bend));
    EXPECT_NEAR(ask({0.0, 0.0, -0.02}), least, 1e-9) << tick;
    EXPECT_LT(least, 0.0);
  }
}

TEST_P(LegRoomTest, WhatTheCoMHasIsNotTakenFromIt) {
  for (const Side side : robot::kSides) lower[6 + knee(side)] = upper[6 + knee(side)] = 0.0;
  EXPECT_LT(std::min(rise_of(kLeft, 0.0, {0.1, 0.0}), rise_of(kRight, 0.0, {0.1, 0.0})), -1e-3);
  EXPECT_EQ(ask({0.1, 0.0, 0.0}), 0.0);
}

INSTANTIATE_TEST_SUITE_P(Robots, LegRoomTest, ::testing::ValuesIn(robots()),
                         [](const auto& robot) { return robot.param.tree.name(); });

}  // namespace

}  // namespace mimesis::walker
