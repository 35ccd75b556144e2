#include "nodes/planner/planner_node.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "common/error.h"
#include "common/model/files.h"
#include "common/testing/loopback.h"
#include "nodes/planner/plan_drawing_node.h"

namespace mimesis::planner {
namespace {
using namespace std::chrono_literals;

/// The node with an arm that follows at once and a hand that stops at the object.
class Bench {
 public:
  /// Scene and decision are told once, unless they are watched.
  explicit Bench(const PlannerParams& params = {.upstream_s = 0.0}) : node(params, bus) {
    arm_q = model::load_arm("lwr4.yaml").home;
    scene = model::to_proto(model::load_table("bridge_table.yaml"));
  }

  void decide(v1::Grip grip, v1::Transport transport, v1::Goal goal, bool settled = true,
              bool sight_lost = false) {
    v1::Decision decision;
    decision.set_grip(grip);
    decision.set_transport(transport);
    decision.set_goal(goal);
    decision.set_settled(settled);
    decision.set_decided_ns(42);
    decision.set_sight_lost(sight_lost);
    bus.send("decision", decision, now);
  }
  void send_states() {
    v1::JointState arm;
    for (const double q : arm_q) arm.add_position_rad(q);
    arm.set_operational(true);
    bus.send("arm", arm, now);
    v1::HandState hand;
    const double end = closure > 0.5 ? 0.24 : 0.0;
    hand.set_closure(end);
    hand.set_object_detected(closure > 0.5);
    hand.set_active(true);
    bus.send("hand", hand, now);
  }
  void step(bool states = true) {
    if (states) send_states();
    node.step(now);
    commanded = false;
    while (const auto command = bus.take<v1::JointCommand>("command")) {
      commanded = true;
      for (int j = 0; j < 7; ++j) arm_q[j] = command->position_rad(j);
    }
    while (const auto hand = bus.take<v1::HandCommand>("hand_command")) closure = hand->closure();
    while (auto next = bus.take<v1::TaskStatus>("status")) {
      if (statuses.empty() || statuses.back().state() != next->state() ||
          statuses.back().phase() != next->phase()) {
        statuses.push_back(*next);
      }
    }
    now += 5ms;
  }
  v1::TaskState state() const {
    return statuses.empty() ? v1::TASK_STATE_UNSPECIFIED : statuses.back().state();
  }
  void until_rest() {
    for (int i = 0; i < 6000; ++i) {
      step();
      if (state() == v1::TASK_STATE_DONE || state() == v1::TASK_STATE_FAILED) return;
    }
  }

  testing::Loopback bus;
  PlannerNode node;
  runtime::Time now = 10s;
  Eigen::VectorXd arm_q;
  double closure = 0.0;
  bool commanded = false;
  v1::Scene scene;
  std::vector<v1::TaskStatus> statuses;
};

TEST(PlannerNode, PlansAndStreamsTheWholeTask) {
  Bench bench;
  bench.bus.send("scene", bench.scene, bench.now);
  for (int i = 0; i < 10; ++i) bench.step();
  EXPECT_EQ(bench.state(), v1::TASK_STATE_IDLE);
  EXPECT_FALSE(bench.commanded);
  bench.decide(v1::GRIP_PRECISION, v1::TRANSPORT_ABOVE, v1::GOAL_HIGH);
  bench.until_rest();
  ASSERT_EQ(bench.state(), v1::TASK_STATE_DONE) << bench.statuses.back().reason();

  std::vector<v1::TaskPhase> phases;
  for (const auto& status : bench.statuses) {
    if (status.state() != v1::TASK_STATE_EXECUTING) continue;
    phases.push_back(status.phase());
    EXPECT_TRUE(status.plan_succeeded());
    EXPECT_EQ(status.grip(), v1::GRIP_PRECISION);
    EXPECT_GT(status.path_length_rad(), 1.0);
    EXPECT_GT(status.roadmap_nodes(), 2000u);
    EXPECT_GT(status.plan_compute_s(), 0.0);
  }
  EXPECT_EQ(phases, (std::vector{v1::TASK_PHASE_REACH, v1::TASK_PHASE_APPROACH,
                                 v1::TASK_PHASE_GRASP, v1::TASK_PHASE_TRANSPORT,
                                 v1::TASK_PHASE_RELEASE, v1::TASK_PHASE_RETREAT}));
  const auto first = bench.bus.take<v1::Trajectory>("trajectory");
  ASSERT_TRUE(first);
  EXPECT_EQ(first->phase(), v1::TASK_PHASE_REACH);
  EXPECT_EQ(first->points(1).time_from_start_ns(), 5'000'000u);
  int trajectories = 1;
  while (bench.bus.take<v1::Trajectory>("trajectory")) ++trajectories;
  EXPECT_EQ(trajectories, 6);

  const auto plan = bench.bus.take<foxglove::SceneUpdate>("plan");
  ASSERT_TRUE(plan);
  EXPECT_FALSE(bench.bus.take<foxglove::SceneUpdate>("plan")) << "one plan";
  const foxglove::SceneEntity& way = plan->entities(0);
  EXPECT_EQ(way.lines_size(), 6);  // the object is lifted and lowered
  ASSERT_EQ(way.texts_size(), 2);
  EXPECT_EQ(way.texts(0).text(), "grasp");
  EXPECT_EQ(way.texts(1).text(), "release");
  const auto& start = way.lines(0).points(0);
  const Eigen::Vector3d p_WE =
      kin::end_effector(model::load_arm("lwr4.yaml"), model::load_arm("lwr4.yaml").home)
          .translation();
  EXPECT_LT((Eigen::Vector3d(start.x(), start.y(), start.z()) - p_WE).norm(), 1e-9);
}

TEST(PlannerDrawing, TheRobotMovesAt25HzAndIsDrawnAnewWhenTheHandMoves) {
  Bench bench;
  for (int i = 0; i < 200; ++i) bench.step();  // 1 s
  const kin::ArmModel arm = model::load_arm("lwr4.yaml");
  const Eigen::Vector3d p_WE = kin::end_effector(arm, arm.home).translation();
  int poses = 0;
  while (const auto frames = bench.bus.take<foxglove::FrameTransforms>("robot_frames")) {
    ++poses;
    EXPECT_DOUBLE_EQ(frames->transforms(8).translation().x(), p_WE.x());
  }
  EXPECT_EQ(poses, 25);
  EXPECT_TRUE(bench.bus.take<foxglove::SceneUpdate>("robot"));
  EXPECT_FALSE(bench.bus.take<foxglove::SceneUpdate>("robot")) << "nothing has moved";
  bench.closure = 0.7;
  for (int i = 0; i < 20; ++i) bench.step();
  EXPECT_TRUE(bench.bus.take<foxglove::SceneUpdate>("robot"));
}

TEST(PlannerDrawing, AnEllipsoidShowsHowWellAPlaceIsKnown) {
  v1::Scene scene;
  v1::GraspObject& object = *scene.mutable_object();
  object.mutable_position_in_world_m()->set_x_m(0.5);
  object.set_radius_m(0.02);
  object.set_height_m(0.1);
  EXPECT_EQ(draw_seen(scene, 0s).entities(0).spheres_size(), 0);  // told exactly
  // Deviations of 1, 2 and 3 mm along axes that stand 45 degrees to x and y.
  const double c = std::sqrt(0.5);
  Eigen::Matrix3d R;
  R << c, -c, 0, c, c, 0, 0, 0, 1;
  const Eigen::Matrix3d L = Eigen::LLT<Eigen::Matrix3d>(
                                R * Eigen::Vector3d(1e-6, 4e-6, 9e-6).asDiagonal() * R.transpose())
                                .matrixL();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j <= i; ++j) object.add_spread_m(L(i, j));
  }
  const foxglove::SceneEntity entity = draw_seen(scene, 0s).entities(0);
  ASSERT_EQ(entity.spheres_size(), 1);
  const foxglove::SpherePrimitive& ball = entity.spheres(0);
  EXPECT_NEAR(ball.size().x(), 6e-3, 1e-9);
  EXPECT_NEAR(ball.size().y(), 12e-3, 1e-9);
  EXPECT_NEAR(ball.size().z(), 18e-3, 1e-9);
  const auto& o = ball.pose().orientation();
  const Eigen::Vector3d x =
      Eigen::Quaterniond(o.w(), o.x(), o.y(), o.z()) * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(std::abs(x.dot(R.col(0))), 1.0, 1e-9);
  EXPECT_EQ(entity.texts(0).text(), "±3.0 mm");
}

TEST(PlannerNode, TellsTheWayWithTheObjectIfAsked) {
  Bench bench({.upstream_s = 0.0, .carried_postures = 5});
  v1::Decision decision;
  decision.set_grip(v1::GRIP_FULL);
  decision.set_transport(v1::TRANSPORT_BELOW);
  decision.set_goal(v1::GOAL_LOW);
  decision.set_settled(true);
  decision.set_decided_ns(42);
  decision.add_preselected()->add_position_rad(1.0);  // of another arm: not used
  bench.bus.send("decision", decision, bench.now);
  bench.bus.send("scene", bench.scene, bench.now);
  while (bench.state() != v1::TASK_STATE_EXECUTING && bench.state() != v1::TASK_STATE_FAILED) {
    bench.step();
  }
  ASSERT_EQ(bench.statuses.back().carried_size(), 5) << bench.statuses.back().reason();
  EXPECT_EQ(bench.statuses.back().carried(4).position_rad_size(), 7);
}

TEST(PlannerNode, ReportsABlockedGoalAndHoldsStill) {
  Bench bench;
  v1::Ball& block = *bench.scene.add_obstacles();
  *block.mutable_center_in_world_m() = bench.scene.goals(1).position_in_world_m();
  block.set_radius_m(0.05);
  ASSERT_EQ(bench.scene.goals(1).goal(), v1::GOAL_LOW);
  bench.bus.send("scene", bench.scene, bench.now);
  bench.decide(v1::GRIP_FULL, v1::TRANSPORT_BELOW, v1::GOAL_LOW);
  const Eigen::VectorXd before = bench.arm_q;
  bench.until_rest();
  ASSERT_EQ(bench.state(), v1::TASK_STATE_FAILED);
  EXPECT_EQ(bench.statuses.back().reason().substr(0, 23), "the low goal is blocked");
  EXPECT_FALSE(bench.statuses.back().plan_succeeded());
  EXPECT_EQ(bench.arm_q, before);
}

TEST(PlannerNode, IgnoresWhatIsNotSettledOrNotWhole) {
  Bench bench;
  bench.bus.send("scene", bench.scene, bench.now);
  bench.decide(v1::GRIP_FULL, v1::TRANSPORT_BELOW, v1::GOAL_LOW, false);
  for (int i = 0; i < 10; ++i) bench.step();
  bench.decide(v1::GRIP_FULL, v1::TRANSPORT_UNSPECIFIED, v1::GOAL_LOW);
  for (int i = 0; i < 10; ++i) bench.step();
  EXPECT_EQ(bench.state(), v1::TASK_STATE_IDLE);
  EXPECT_FALSE(bench.commanded);
}

TEST(PlannerNode, WaitsWhenScenesDecisionsOrTheTeacherAreLost) {
  Bench bench{PlannerParams{}};
  bool scenes = true, decisions = true, sight = true;
  const auto step = [&] {
    if (scenes) bench.bus.send("scene", bench.scene, bench.now);
    if (decisions)
      bench.decide(v1::GRIP_PRECISION, v1::TRANSPORT_ABOVE, v1::GOAL_HIGH, true, !sight);
    const Eigen::VectorXd before = bench.arm_q;
    bench.step();
    return (bench.arm_q - before).cwiseAbs().maxCoeff();
  };
  const auto until_moving = [&] {
    for (int i = 0; i < 2000; ++i) {
      if (step() > 0.003) return true;
    }
    return false;
  };
  for (bool* lost : {&scenes, &decisions, &sight}) {
    ASSERT_TRUE(until_moving());
    *lost = false;
    int periods = 0;
    while (step() > 0.0 && periods < 100) ++periods;
    EXPECT_LE(periods * 5ms, 300ms);
    for (int i = 0; i < 50; ++i) EXPECT_EQ(step(), 0.0);
    *lost = true;
  }
  EXPECT_TRUE(until_moving());
}

/// Steps that come late or not at all change neither the path nor its times.
TEST(PlannerNode, CommandsAreThoseOfEvenTimes) {
  std::map<std::uint64_t, double> commanded[2];  // stamp, first joint
  for (const bool late : {false, true}) {
    Bench bench;
    bench.bus.send("scene", bench.scene, bench.now);
    bench.decide(v1::GRIP_PRECISION, v1::TRANSPORT_ABOVE, v1::GOAL_HIGH);
    std::mt19937 random(3);
    for (int k = 0; k < 390; ++k, bench.now += 5ms) {  // within the reach
      const runtime::Time even = bench.now;
      if (late) bench.now += std::chrono::microseconds(random() % 5000);
      if (late && k > 100 && random() % 10 == 0) {
        bench.now = even;
        continue;  // left out
      }
      bench.send_states();
      bench.node.step(bench.now);
      bench.now = even;
      while (const auto command = bench.bus.take<v1::JointCommand>("command")) {
        commanded[late][command->header().stamp_ns()] = command->position_rad(0);
        for (int j = 0; j < 7; ++j) bench.arm_q[j] = command->position_rad(j);
      }
    }
  }
  EXPECT_GT(commanded[1].size(), 300U);
  for (const auto& [stamp, q] : commanded[1]) {
    ASSERT_TRUE(commanded[0].contains(stamp)) << stamp;
    EXPECT_EQ(commanded[0].at(stamp), q) << stamp;
  }
}

TEST(PlannerNode, FallsSilentWhenTheArmDoes) {
  Bench bench;
  bench.bus.send("scene", bench.scene, bench.now);
  bench.decide(v1::GRIP_FULL, v1::TRANSPORT_BELOW, v1::GOAL_LOW);
  for (int i = 0; i < 200; ++i) bench.step();
  ASSERT_EQ(bench.state(), v1::TASK_STATE_EXECUTING);
  EXPECT_TRUE(bench.commanded);
  for (int i = 0; i < 22; ++i) bench.step(false);  // 110 ms: the last state is older than stale_s
  EXPECT_EQ(bench.state(), v1::TASK_STATE_FAILED);
  EXPECT_EQ(bench.statuses.back().reason(), "the arm's state is stale");
  EXPECT_FALSE(bench.commanded);
}

TEST(PlannerNode, AJointStateWithAnotherNumberOfJointsIsNoState) {
  PlannerParams params{.upstream_s = 0.0};
  params.ready_s = 0.1;
  Bench bench(params);
  bench.bus.send("scene", bench.scene, bench.now);
  bench.decide(v1::GRIP_FULL, v1::TRANSPORT_BELOW, v1::GOAL_LOW);
  bench.arm_q.conservativeResize(6);
  for (int i = 0; i < 30; ++i) bench.step();
  EXPECT_EQ(bench.state(), v1::TASK_STATE_FAILED);
  EXPECT_EQ(bench.statuses.back().reason(), "waited in vain for the state of the arm");
  EXPECT_FALSE(bench.commanded);
}

TEST(PlannerNode, TellsItsStatusOnceASecond) {
  Bench bench;
  int count = 0;
  for (int i = 0; i < 601; ++i) {
    bench.node.step(bench.now);
    while (bench.bus.take<v1::TaskStatus>("status")) ++count;
    bench.now += 5ms;
  }
  EXPECT_EQ(count, 4);
}

TEST(PlannerNode, RefusesAMissingModelFile) {
  testing::Loopback bus;
  PlannerParams params{.upstream_s = 0.0};
  params.robot = "nowhere.yaml";
  EXPECT_THROW(PlannerNode(params, bus), ConfigError);
}

}  // namespace
}  // namespace mimesis::planner
