// The judge of the world accepts the planner's plans: played without any error of drives or hand,
// they grasp, pass the bar as decided, place, and touch nothing. The two share models and
// kinematics only.
#include <gtest/gtest.h>

#include "common/model/files.h"
#include "hw/sim/world/world.h"
#include "nodes/planner/task_plan.h"

namespace mimesis {
namespace {

const std::string kModels = std::string(MIMESIS_SOURCE_DIR) + "/models/";

struct Trial {
  planner::Task task;
  double bar_height_m;
};

void PrintTo(const Trial& trial, std::ostream* out) {
  *out << (trial.task.grip == task::Grip::full ? "full " : "precision ")
       << (trial.task.transport == task::Transport::above ? "above " : "below ") << trial.task.goal
       << ", bar at " << trial.bar_height_m << " m";
}

class PlanInWorld : public ::testing::TestWithParam<Trial> {
 protected:
  /// Holds the posture for one second while the hand moves to `closure`.
  void move_hand(world::World& world, const Eigen::VectorXd& q, double from, double to) {
    for (int i = 1; i <= 100; ++i) world.step(0.01, q, {grip(), from + (to - from) * i / 100});
  }
  task::Grip grip() const {
    return GetParam().task.grip == task::Grip::full ? task::Grip::full : task::Grip::precision;
  }
};

TEST_P(PlanInWorld, PlacesTheObjectAndTouchesNothing) {
  const kin::ArmModel arm = model::load_arm(kModels + "lwr4.yaml");
  const kin::Table table = model::load_table(kModels + "bar_table.yaml", GetParam().bar_height_m);
  const planner::TaskSettings settings;
  const auto plan = planner::plan_task(arm, table, planner::prepare_roadmap(arm, table, settings),
                                       arm.home, GetParam().task, settings);
  ASSERT_TRUE(plan) << plan.error().reason;

  world::World world(arm, table);
  double closure = 0.0;
  std::optional<double> bar_crossed_at;  // height of the object's centre where it passes the bar
  for (const planner::PlannedMotion& motion : plan->motions) {
    const Eigen::MatrixXd& q = motion.trajectory.position;
    if (motion.phase == planner::Phase::retreat && closure > 0.0) {
      move_hand(world, q.col(0), closure, 0.0);
      closure = 0.0;
    }
    for (Eigen::Index k = 0; k < q.cols(); ++k) {
      const Eigen::Vector3d before = world.object().cylinder().X_WO.translation();
      world.step(motion.trajectory.period_s, q.col(k), {grip(), closure});
      const Eigen::Vector3d after = world.object().cylinder().X_WO.translation();
      if ((before.x() < table.bar_center.x()) != (after.x() < table.bar_center.x())) {
        bar_crossed_at = after.z();
      }
    }
    if (motion.phase == planner::Phase::approach) {
      ASSERT_TRUE(world.contact().reachable);
      move_hand(world, q.rightCols(1), 0.0, closure = world.contact().closure);
      ASSERT_EQ(world.object().state(), world::ObjectState::held);
    }
  }
  const world::Verdict verdict = world::judge(
      {.done = true, .goal = GetParam().task.goal, .reason = ""}, world.object(), table.goals);
  EXPECT_TRUE(verdict.placed) << verdict.reason;
  EXPECT_LT(verdict.placement_error, 2e-3);
  EXPECT_EQ(world.collisions().count(), 0) << world.collisions().last();
  ASSERT_TRUE(bar_crossed_at);
  EXPECT_EQ(*bar_crossed_at > table.bar_center.z(),
            GetParam().task.transport == task::Transport::above);
}

using task::Grip;
using task::Transport;
INSTANTIATE_TEST_SUITE_P(BridgeParadigm, PlanInWorld,
                         ::testing::Values(Trial{{Grip::precision, Transport::above, "high"}, 0.42},
                                           Trial{{Grip::full, Transport::below, "low"}, 0.42},
                                           Trial{{Grip::full, Transport::below, "high"}, 0.42},
                                           Trial{{Grip::precision, Transport::above, "low"}, 0.20},
                                           Trial{{Grip::full, Transport::above, "high"}, 0.20}));

}  // namespace
}  // namespace mimesis
