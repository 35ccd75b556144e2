#include "nodes/planner/move_plan.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/model/files.h"

namespace mimesis::planner {
namespace {

struct MoveDemo {
  kin::ArmModel arm = model::load_arm("lwr4.yaml");
  kin::Table table = model::load_table("bar_table.yaml");
  TaskSettings settings;

  tl::expected<TaskPlan, Status> plan(const PlanRequest& request) const {
    return plan_move(arm, {}, request, settings);
  }
  Eigen::Vector3d hand(const Eigen::VectorXd& q) const {
    return kin::end_effector(arm, q).translation();
  }
};

/// Motions fit together, and each is free of its obstacles at every sample.
void expect_sound(const MoveDemo& demo, const TaskPlan& plan, const Eigen::VectorXd& start) {
  Eigen::VectorXd at = start;
  for (const PlannedMotion& motion : plan.motions) {
    EXPECT_EQ(motion.phase, Phase::reach);
    const auto& q = motion.trajectory.position;
    EXPECT_LT((q.col(0) - at).norm(), 1e-12);
    CollisionChecker checker(demo.arm, motion.obstacles, demo.settings.margin_m);
    const auto free = checker.free_columns(q);
    EXPECT_EQ(std::ranges::count(free, 0), 0);
    at = q.rightCols(1);
  }
}

TEST(MovePlan, RestsAtEveryPlaceOfItsWayInTurn) {
  const MoveDemo demo;
  Eigen::VectorXd middle = demo.arm.home;
  middle[0] = 0.9;
  const Eigen::Vector3d beside(0.35, -0.35, 0.6);
  const Move move{{{middle}, {{}, beside}}, {{demo.arm.home}}};
  const auto plan = demo.plan({demo.table, demo.arm.home, move});
  ASSERT_TRUE(plan) << plan.error().reason;
  expect_sound(demo, *plan, demo.arm.home);
  ASSERT_EQ(plan->motions.size(), 3u);
  EXPECT_EQ(plan->passed, (std::vector<std::size_t>{0, 1, 2}));
  EXPECT_EQ(plan->motions[0].trajectory.position.rightCols(1), middle);
  EXPECT_LT((demo.hand(plan->motions[1].trajectory.position.rightCols(1)) - beside).norm(), 1e-4);
  EXPECT_EQ(plan->motions[2].trajectory.position.rightCols(1), demo.arm.home);
}

TEST(MovePlan, EndsInTheNearestGoalThatCanBeReached) {
  const MoveDemo demo;
  Eigen::VectorXd near = demo.arm.home, far = demo.arm.home;
  near[0] += 0.4;
  far[0] += 1.5;
  const auto plan = demo.plan({demo.table, demo.arm.home, Move{{}, {{far}, {near}}}});
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->motions.back().trajectory.position.rightCols(1), near);
  EXPECT_TRUE(demo.plan({demo.table, near, Move{{}, {{near}}}})->motions.empty()) << "it is there";
}

TEST(MovePlan, SaysWhichPlaceFails) {
  const MoveDemo demo;
  const Eigen::Vector3d out_of_reach(3.0, 0.0, 0.5);
  const auto reason = [&](const Move& move) {
    const auto plan = demo.plan({demo.table, demo.arm.home, move});
    return plan ? "planned" : plan.error().reason;
  };
  EXPECT_EQ(reason({{{demo.arm.home}, {{}, out_of_reach}}, {{demo.arm.home}}}),
            "no posture reaches place 2 of the way");
  EXPECT_EQ(reason({{}, {{{}, out_of_reach}}}), "no posture reaches the goal");
  Eigen::VectorXd through_the_table = demo.arm.home;
  through_the_table[1] = 2.0, through_the_table[3] = 0.0;
  EXPECT_NE(reason({{}, {{through_the_table}}}).find("to the goal: of the postures"),
            std::string::npos)
      << reason({{}, {{through_the_table}}});
}

/// With the hand at the object a move first goes straight back; with the object lifted up.
TEST(MovePlan, LeavesTheObjectAndLiftsWhatItHolds) {
  const MoveDemo demo;
  const auto roadmap = prepare_roadmap(demo.arm, demo.table, demo.settings);
  const auto task = plan_task(demo.arm, demo.table, roadmap, demo.arm.home, {}, demo.settings);
  ASSERT_TRUE(task) << task.error().reason;
  const PlannedMotion& approach = task->motions[1];
  ASSERT_EQ(approach.phase, Phase::approach);
  const Eigen::VectorXd grasp = approach.trajectory.position.rightCols(1);
  const Move home{{}, {{demo.arm.home}}};

  kin::Table thick = demo.table;  // such that the open hand touches it
  thick.object_radius += 0.015;
  const auto empty = demo.plan({thick, grasp, home});
  ASSERT_TRUE(empty) << empty.error().reason;
  expect_sound(demo, *empty, grasp);
  const Eigen::Vector3d back = demo.hand(empty->motions[0].trajectory.position.rightCols(1)),
                        axis = kin::end_effector(demo.arm, grasp).linear().col(2);
  EXPECT_LT((back - (demo.hand(grasp) - demo.settings.approach_m * axis)).norm(), 1e-4);
  EXPECT_EQ(empty->motions.back().trajectory.position.rightCols(1), demo.arm.home);

  const auto& held = task->motions[2].obstacles.held;
  ASSERT_FALSE(held.empty());
  const auto holding = demo.plan({demo.table, grasp, home, held});
  ASSERT_TRUE(holding) << holding.error().reason;
  expect_sound(demo, *holding, grasp);
  const Eigen::Vector3d up = demo.hand(holding->motions[0].trajectory.position.rightCols(1));
  EXPECT_NEAR(up.z() - demo.hand(grasp).z(), demo.settings.lift_m, 1e-4);
  for (const auto& motion : holding->motions) EXPECT_EQ(motion.obstacles.held.size(), held.size());
}

/// An arm in free space of which the first and last joints turn without end.
struct Endless : MoveDemo {
  Endless() {
    table = {};
    for (const Eigen::Index j : {Eigen::Index{0}, Eigen::Index{6}}) {
      arm.links[static_cast<std::size_t>(j)].endless = true;
      arm.q_min[j] = -2.0 * M_PI;
      arm.q_max[j] = 2.0 * M_PI;
    }
  }
  Eigen::VectorXd at(double first, double last) const {
    Eigen::VectorXd q = arm.home;
    q[0] = first;
    q[6] = last;
    return q;
  }
  tl::expected<TaskPlan, Status> go(const Eigen::VectorXd& from, const Eigen::VectorXd& to) const {
    return plan_request(arm, {}, {table, from, Move{{}, {{to}}}}, settings);
  }
};

TEST(MovePlan, EndlessJointsGoTheShortestWay) {
  const Endless demo;
  const auto plan = demo.go(demo.at(3.0, -3.1), demo.at(-3.0, 3.0));
  ASSERT_TRUE(plan) << plan.error().reason;
  const double turn = 2.0 * M_PI;
  EXPECT_NEAR(plan->path_length_rad, std::hypot(turn - 6.0, turn - 6.1), 1e-9);
  EXPECT_LT(
      (plan->motions.back().trajectory.position.rightCols(1) - demo.at(turn - 3.0, 3.0 - turn))
          .norm(),
      1e-12);
}

TEST(MovePlan, EndlessJointsStartAnywhere) {
  const Endless demo;
  const double turns = 6.0 * M_PI;
  const Eigen::VectorXd from = demo.at(turns + 0.5, 0.0);
  const auto plan = demo.go(from, demo.at(-0.5, 0.0));
  ASSERT_TRUE(plan) << plan.error().reason;
  expect_sound(demo, *plan, from);
  EXPECT_NEAR(plan->path_length_rad, 1.0, 1e-9);
  EXPECT_NEAR(plan->motions.back().trajectory.position.rightCols(1)(0), turns - 0.5, 1e-12);
  EXPECT_NEAR(plan->motions.front().curves.front()(0, 0), turns + 0.5, 1e-12);
}

TEST(MovePlan, StartsAtALimitThatNoisePasses) {
  const MoveDemo demo;
  const auto from = [&](double beyond) {
    Eigen::VectorXd q = demo.arm.home;
    q[6] = demo.arm.q_max[6] + beyond;
    return plan_request(demo.arm, {}, {demo.table, q, Move{{}, {{demo.arm.home}}}}, demo.settings);
  };
  const auto plan = from(1e-9);
  ASSERT_TRUE(plan) << plan.error().reason;
  EXPECT_EQ(plan->motions.front().trajectory.position(6, 0), demo.arm.q_max[6]);
  EXPECT_TRUE(from(0.9 * kAtLimit));
  const auto far = from(0.1);
  ASSERT_FALSE(far);
  EXPECT_EQ(far.error().reason.find("the start: joint 7 at "), 0u) << far.error().reason;
  EXPECT_FALSE(from(std::nan("")));
}

TEST(MovePlan, EndsWhenItIsToldToStop) {
  MoveDemo demo;
  long asked = 0;
  demo.settings.interrupt = Interrupt("told so", [&asked] { return ++asked > 3; });
  Eigen::VectorXd far = demo.arm.home;
  far[0] += 2.5;
  EXPECT_FALSE(demo.plan({demo.table, demo.arm.home, Move{{{far}}, {{demo.arm.home}}}}));
  EXPECT_LT(asked, 1000);
}

}  // namespace
}  // namespace mimesis::planner
