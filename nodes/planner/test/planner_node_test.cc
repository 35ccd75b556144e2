#include "nodes/planner/planner_node.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "common/error.h"
#include "common/model/files.h"
#include "common/model/messages.h"
#include "common/testing/loopback.h"

namespace mimesis::planner {
namespace {
using namespace std::chrono_literals;

/// The node with an arm that follows at once and a hand that stops at the object.
class Bench {
 public:
  /// Scene and decision are told once, unless they are watched.
  explicit Bench(const PlannerParams& params = {.upstream_s = 0.0}) : node(params, bus) {
    arm_q = model::load_arm("lwr4.yaml").home;
    scene = model::to_proto(model::load_table("bar_table.yaml"));
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
    bus.send("joint_states", arm, now);
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

TEST(PlannerNode, SaysWhatItWaitsForAtRestAndForHowLong) {
  Bench bench;
  const auto says = [&bench](int steps) {
    std::string reason = "no status";
    for (int i = 0; i < steps; ++i) {
      bench.send_states();
      bench.node.step(bench.now);
      while (const auto status = bench.bus.take<v1::TaskStatus>("status"))
        reason = status->reason();
      bench.now += 5ms;
    }
    return reason;
  };
  EXPECT_EQ(says(1), "waits for a decision");
  EXPECT_EQ(says(410), "waits for a decision, 2 s so far");
  bench.decide(v1::GRIP_PRECISION, v1::TRANSPORT_ABOVE, v1::GOAL_HIGH);
  EXPECT_EQ(says(1), "waits for the scene");
  EXPECT_EQ(says(200), "waits for the scene, 1 s so far");
  bench.bus.send("scene", bench.scene, bench.now);
  EXPECT_EQ(says(1), "");
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

/// Clients of the node.
class Clients : public Bench {
 public:
  Clients() { bus.send("scene", scene, now); }

  tl::expected<v1::PlanTicket, Status> ask(const char* service, const v1::PlanRequest& asked) {
    const auto answer = bus.call(std::string("test/") + service, asked.SerializeAsString(), 1s);
    v1::PlanTicket ticket;
    if (!answer) return tl::unexpected(answer.error());
    EXPECT_TRUE(ticket.ParseFromString(*answer));
    return ticket;
  }
  std::string refusal(const char* service, const v1::PlanRequest& asked) {
    const auto answer = ask(service, asked);
    return answer ? "taken" : answer.error().reason;
  }
  std::string abort(std::uint64_t ticket) {
    v1::PlanTicket asked;
    asked.set_ticket(ticket);
    const auto answer = bus.call("test/abort", asked.SerializeAsString(), 1s);
    return answer ? "" : answer.error().reason;
  }
  v1::PlanAnswer answer() {
    for (int i = 0; i < 6000; ++i) {
      if (auto answer = bus.take<v1::PlanAnswer>("answer")) return *answer;
      step();
    }
    ADD_FAILURE() << "no answer";
    return {};
  }

  static v1::PlanRequest task(v1::Grip grip, v1::Transport transport, v1::Goal goal) {
    v1::PlanRequest asked;
    asked.set_grip(grip);
    asked.set_transport(transport);
    asked.set_goal(goal);
    return asked;
  }
  /// Away from the bar.
  static v1::PlanRequest turned(double by_rad) {
    v1::PlanRequest asked;
    Eigen::VectorXd q = model::load_arm("lwr4.yaml").home;
    q[0] -= by_rad;
    asked.add_to()->mutable_position_rad()->Add(q.begin(), q.end());
    return asked;
  }
};

TEST(Requests, TestsAndPlansMoveNothing) {
  Clients clients;
  auto possible = Clients::task(v1::GRIP_FULL, v1::TRANSPORT_BELOW, v1::GOAL_LOW);
  possible.set_client("a");
  auto impossible = Clients::task(v1::GRIP_FULL, v1::TRANSPORT_ABOVE, v1::GOAL_HIGH);
  impossible.set_client("b");
  const auto first = clients.ask("test", possible), second = clients.ask("test", impossible),
             third = clients.ask("plan", clients.turned(0.5));
  ASSERT_TRUE(first && second && third);
  EXPECT_EQ(first->ticket(), 1u);
  EXPECT_EQ(second->before(), 1u);
  EXPECT_EQ(third->before(), 2u);

  const auto one = clients.answer(), two = clients.answer(), three = clients.answer();
  EXPECT_EQ(one.client(), "a");
  EXPECT_TRUE(one.succeeded()) << one.reason();
  EXPECT_GT(one.duration_s(), 1.0);
  EXPECT_GT(one.length_rad(), 1.0);
  EXPECT_EQ(one.motions_size(), 0);
  EXPECT_EQ(two.client(), "b");
  EXPECT_FALSE(two.succeeded());
  EXPECT_NE(two.reason(), "");
  EXPECT_TRUE(three.succeeded()) << three.reason();
  ASSERT_EQ(three.motions_size(), 1);
  const auto& last = three.motions(0).points(three.motions(0).points_size() - 1);
  EXPECT_NEAR(last.position_rad(0), clients.arm_q[0] - 0.5, 1e-12);
  EXPECT_FALSE(clients.commanded);
  EXPECT_EQ(clients.state(), v1::TASK_STATE_IDLE);

  v1::PlanTicket asked;
  asked.set_ticket(2);
  v1::PlanAnswer again;
  ASSERT_TRUE(
      again.ParseFromString(*clients.bus.call("test/answer", asked.SerializeAsString(), 1s)));
  EXPECT_EQ(again.reason(), two.reason());
  asked.set_ticket(4);
  EXPECT_EQ(clients.bus.call("test/answer", asked.SerializeAsString(), 1s).error().reason,
            "no ticket 4");
}

TEST(Requests, OrdersAreDoneInTurnAndAbortedAmidAMotion) {
  Clients clients;
  const Eigen::VectorXd home = clients.arm_q;
  ASSERT_TRUE(clients.ask("do", clients.turned(0.6)));
  ASSERT_TRUE(clients.ask("do", clients.turned(1.0)));
  EXPECT_TRUE(clients.answer().succeeded());
  EXPECT_NEAR(clients.arm_q[0], home[0] - 0.6, 1e-9);
  const auto second = clients.answer();
  EXPECT_TRUE(second.succeeded());
  EXPECT_EQ(second.ticket(), 2u);
  EXPECT_NEAR(clients.arm_q[0], home[0] - 1.0, 1e-9);

  ASSERT_TRUE(clients.bus.call("test/home", "", 1s));
  ASSERT_TRUE(clients.ask("do", clients.turned(0.5)));
  while (clients.arm_q[0] < home[0] - 0.5) clients.step();
  EXPECT_EQ(clients.statuses.back().ticket(), 3u);
  EXPECT_EQ(clients.abort(7), "ticket 7 neither waits nor is done");
  EXPECT_EQ(clients.abort(0), "");
  const auto waited = clients.answer(), moved = clients.answer();
  EXPECT_EQ(waited.ticket(), 4u);
  EXPECT_EQ(moved.ticket(), 3u);
  EXPECT_EQ(waited.reason(), "aborted");
  EXPECT_EQ(moved.reason(), "aborted");
  const double at = clients.arm_q[0];
  EXPECT_GT(at, home[0] - 0.5);
  EXPECT_LT(at, home[0] - 0.1);
  for (int i = 0; i < 200; ++i) clients.step();
  EXPECT_EQ(clients.arm_q[0], at) << "it holds";
  ASSERT_TRUE(clients.bus.call("test/home", "", 1s));
  EXPECT_TRUE(clients.answer().succeeded());
  EXPECT_LT((clients.arm_q - home).norm(), 1e-9);
}

TEST(Requests, ADecisionGoesFirstAndIsNotBegunTwice) {
  Clients clients;
  ASSERT_TRUE(clients.ask("do", clients.turned(0.3)));
  clients.decide(v1::GRIP_FULL, v1::TRANSPORT_BELOW, v1::GOAL_LOW);
  clients.until_rest();
  EXPECT_EQ(clients.state(), v1::TASK_STATE_DONE) << clients.statuses.back().reason();
  EXPECT_EQ(clients.statuses.back().ticket(), 0u);
  EXPECT_TRUE(clients.answer().succeeded());
  for (int i = 0; i < 50; ++i) clients.step();
  EXPECT_EQ(clients.statuses.back().ticket(), 1u);
  EXPECT_EQ(clients.state(), v1::TASK_STATE_DONE) << "the decision is done, too";

  clients.statuses.clear();
  EXPECT_EQ(clients.abort(0), "") << "nothing is done: that is no mistake";
  for (int i = 0; i < 50; ++i) clients.step();
  EXPECT_NE(clients.state(), v1::TASK_STATE_FAILED);
}

TEST(Requests, AnOrderNeedsTheSceneButNoDecision) {
  Bench bench({.upstream_s = 0.06});
  const auto asked = Clients::turned(0.5).SerializeAsString();
  ASSERT_TRUE(bench.bus.call("test/do", asked, 1s));
  std::optional<v1::PlanAnswer> answer;
  for (int i = 0; i < 2000 && !answer; ++i) {
    if (i < 100) bench.bus.send("scene", bench.scene, bench.now);
    bench.step();
    answer = bench.bus.take<v1::PlanAnswer>("answer");
  }
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->reason(), "waited in vain for the scene");
  ASSERT_TRUE(bench.bus.call("test/do", asked, 1s));
  answer.reset();
  for (int i = 0; i < 2000 && !answer; ++i) {
    bench.bus.send("scene", bench.scene, bench.now);
    bench.step();
    answer = bench.bus.take<v1::PlanAnswer>("answer");
  }
  ASSERT_TRUE(answer);
  EXPECT_TRUE(answer->succeeded()) << answer->reason();
}

TEST(Requests, AProposalIsTestedWithoutAMotion) {
  Clients clients;
  const auto propose = [&](v1::Transport transport, std::uint64_t decided_ns) {
    v1::Decision proposal;
    proposal.set_grip(v1::GRIP_FULL);
    proposal.set_transport(transport);
    proposal.set_goal(v1::GOAL_LOW);
    proposal.set_settled(true);
    proposal.set_decided_ns(decided_ns);
    clients.bus.send("proposal", proposal, clients.now);
    for (int i = 0; i < 5; ++i) clients.step();
    return clients.bus.take<v1::TaskStatus>("trial");
  };
  const auto below = propose(v1::TRANSPORT_BELOW, 5);
  ASSERT_TRUE(below);
  EXPECT_TRUE(below->plan_succeeded()) << below->reason();
  EXPECT_EQ(below->transport(), v1::TRANSPORT_BELOW);
  EXPECT_FALSE(propose(v1::TRANSPORT_BELOW, 5)) << "the same one is tested once";
  const auto other = propose(v1::TRANSPORT_ABOVE, 6);
  ASSERT_TRUE(other);
  EXPECT_EQ(other->transport(), v1::TRANSPORT_ABOVE);
  EXPECT_EQ(clients.abort(0), "");
  EXPECT_EQ(clients.state(), v1::TASK_STATE_IDLE);
  EXPECT_FALSE(clients.commanded);
  EXPECT_FALSE(clients.bus.take<v1::PlanAnswer>("answer"));
}

TEST(Requests, WhatCannotBeIsRefusedInOneLine) {
  Clients clients;
  EXPECT_EQ(clients.refusal("test", {}),
            "expected one of a task (grip, transport, goal), `to`, `home` and `tool`");
  auto both = clients.turned(0.1);
  both.set_home(true);
  EXPECT_EQ(clients.refusal("do", both),
            "expected one of a task (grip, transport, goal), `to`, `home` and `tool`");
  v1::PlanRequest half;
  half.set_grip(v1::GRIP_FULL);
  EXPECT_EQ(clients.refusal("plan", half),
            "a task needs grip, transport and goal, each one of proto/task.proto");
  auto nan = clients.turned(0.1);
  nan.mutable_to(0)->set_position_rad(3, NAN);
  EXPECT_EQ(clients.refusal("do", nan), "to[0]: joint 4 at nan rad, expected -2.0944 .. 2.0944");
  auto few = clients.turned(0.1);
  few.add_via()->add_position_rad(0.5);
  EXPECT_EQ(clients.refusal("do", few), "via[0]: 1 joints, expected 7 (lwr4)");
  auto nowhere = clients.turned(0.1);
  nowhere.add_via();
  EXPECT_EQ(clients.refusal("do", nowhere), "via[0]: expected position_rad or hand_in_world_m");
  auto late = clients.turned(0.1);
  late.set_deadline_s(-1.0);
  EXPECT_EQ(clients.refusal("test", late), "deadline_s: -1, expected 0 .. 3600");
  auto from = clients.turned(0.1);
  *from.mutable_start()->mutable_position_rad() = from.to(0).position_rad();
  EXPECT_EQ(clients.refusal("do", from), "start: the arm starts where it is");
  EXPECT_EQ(clients.refusal("test", from), "taken");
  for (int i = 0; i < 40; ++i) (void)clients.ask("do", clients.turned(0.1));
  EXPECT_EQ(clients.refusal("do", clients.turned(0.1)), "32 requests wait already");
}

TEST(Requests, TheToolGoesStraight) {
  Clients clients;
  const kin::ArmModel arm = model::load_arm("lwr4.yaml");
  const Eigen::Isometry3d X = kin::end_effector(arm, clients.arm_q);
  v1::PlanRequest asked;
  model::to_proto(Eigen::Vector3d(X.translation() + Eigen::Vector3d(-0.05, -0.1, 0.0)),
                  *asked.add_tool()->mutable_to_in_world_m());
  ASSERT_TRUE(clients.ask("do", asked));
  const auto answer = clients.answer();
  EXPECT_TRUE(answer.succeeded()) << answer.reason();
  const Eigen::Isometry3d at = kin::end_effector(arm, clients.arm_q);
  EXPECT_LT((at.translation() - X.translation() - Eigen::Vector3d(-0.05, -0.1, 0.0)).norm(), 2e-5);
  EXPECT_TRUE(at.linear().isApprox(X.linear(), 1e-3));
  asked.set_tool_off_m(1e-5);
  EXPECT_EQ(clients.refusal("plan", asked), "tool_off_m: 1e-05, expected 0.0002 .. 0.1");
  asked.set_tool_off_m(0.0);
  asked.mutable_tool(0)->mutable_to_in_world_m()->set_x_m(NAN);
  EXPECT_EQ(clients.refusal("plan", asked), "tool[0]: expected finite to_in_world_m");
}

/// A crate about the hand when joint 1 has turned.
v1::Obstacle crate(double turned_rad) {
  const kin::ArmModel arm = model::load_arm("lwr4.yaml");
  Eigen::VectorXd q = arm.home;
  q[0] -= turned_rad;
  v1::Obstacle obstacle;
  obstacle.set_name("crate");
  v1::Box& box = *obstacle.add_boxes();
  model::to_proto(kin::end_effector(arm, q).translation(), *box.mutable_center_in_world_m());
  model::to_proto(Eigen::Vector3d(0.03, 0.03, 0.03), *box.mutable_half_extent_m());
  return obstacle;
}
/// Names of all, or the reason.
std::string put(Clients& clients, const v1::Obstacle& obstacle) {
  const auto answer = clients.bus.call("test/obstacle", obstacle.SerializeAsString(), 1s);
  if (!answer) return answer.error().reason;
  v1::ObstacleNames names;
  EXPECT_TRUE(names.ParseFromString(*answer));
  std::string all;
  for (const std::string& name : names.name()) all += name + " ";
  return all;
}

TEST(AddedObstacles, AreInTheWayUntilTheyAreTakenAway) {
  Clients clients;
  const auto reason = [&] {
    EXPECT_TRUE(clients.ask("test", clients.turned(0.5)));
    return clients.answer().reason();
  };
  EXPECT_EQ(reason(), "");
  EXPECT_EQ(put(clients, crate(0.5)), "crate ");
  EXPECT_NE(reason().find("touches the crate"), std::string::npos) << reason();
  v1::Obstacle post;
  post.set_name("post");
  v1::Hull& hull = *post.add_hulls();
  for (const double z : {0.2, 0.4})
    model::to_proto(Eigen::Vector3d(-0.5, 0.5, z), *hull.add_points_in_world_m());
  hull.set_radius_m(0.02);
  EXPECT_EQ(put(clients, post), "crate post ");
  clients.bus.send("scene", clients.scene, clients.now);  // a new one keeps them
  EXPECT_NE(reason().find("touches the crate"), std::string::npos);
  EXPECT_EQ(put(clients, crate(1.5)), "crate post ") << "it is elsewhere";
  EXPECT_EQ(reason(), "");
  v1::Obstacle gone;
  gone.set_name("crate");
  EXPECT_EQ(put(clients, gone), "post ");
  EXPECT_EQ(put(clients, gone), "no obstacle 'crate' was added");

  auto wrong = crate(0.5);
  wrong.mutable_boxes(0)->mutable_center_in_world_m()->set_x_m(NAN);
  EXPECT_EQ(put(clients, wrong), "boxes: expected a place and half_extent_m above 0, below 100 m");
  wrong = crate(0.5);
  wrong.clear_name();
  EXPECT_EQ(put(clients, wrong), "name: expected 1 to 64 bytes");
  wrong.set_name("nothing");
  wrong.clear_boxes();
  wrong.add_hulls();
  EXPECT_EQ(put(clients, wrong),
            "hulls: expected points and radius_m not below 0, all below 100 m");
  EXPECT_EQ(reason(), "") << "what is refused is not there";
}

/// It brakes and finds another way; one of the tool's ends there.
TEST(AddedObstacles, AreKeptClearOfByAnArmThatMovesTowardsThem) {
  const kin::ArmModel arm = model::load_arm("lwr4.yaml");
  Obstacles there;
  there.boxes = {
      {model::to_eigen(crate(1.0).boxes(0).center_in_world_m()), {0.03, 0.03, 0.03}, ""}};
  for (const bool tool : {false, true}) {
    Clients clients;
    const Eigen::VectorXd home = clients.arm_q;
    v1::PlanRequest asked = clients.turned(1.2);
    if (tool) {
      const Eigen::Vector3d p = kin::end_effector(arm, home).translation();
      const Eigen::Vector3d to = model::to_eigen(crate(1.0).boxes(0).center_in_world_m());
      asked.clear_to();
      model::to_proto(Eigen::Vector3d(p + 1.1 * (to - p)),
                      *asked.add_tool()->mutable_to_in_world_m());
    }
    ASSERT_TRUE(clients.ask("do", asked));
    while (clients.arm_q[0] > home[0] - 0.2) clients.step();
    put(clients, crate(1.0));
    CollisionChecker checker(arm, there, 0.001);
    std::optional<v1::PlanAnswer> answer;
    for (int i = 0; i < 6000 && !answer; ++i) {
      answer = clients.bus.take<v1::PlanAnswer>("answer");
      clients.step();
      ASSERT_TRUE(checker.free(clients.arm_q)) << "step " << i;
    }
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->succeeded(), !tool) << answer->reason();
    if (tool) {
      EXPECT_EQ(answer->reason(), "an obstacle moved into the way");
    }
    EXPECT_LT(clients.arm_q[0], home[0] - (tool ? 0.2 : 1.19));
  }
}

TEST(Requests, ATestWaitsForTheSceneAndSaysSo) {
  Bench bench({.upstream_s = 0.0, .ready_s = 0.5});
  v1::PlanRequest asked;
  asked.set_home(true);
  ASSERT_TRUE(bench.bus.call("test/test", asked.SerializeAsString(), 1s));
  for (int i = 0; i < 110; ++i) bench.step();
  const auto answer = bench.bus.take<v1::PlanAnswer>("answer");
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->reason(), "waited in vain for the scene");
}

}  // namespace
}  // namespace mimesis::planner
