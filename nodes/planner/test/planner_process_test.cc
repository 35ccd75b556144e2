#include <gtest/gtest.h>

#include "common/model/files.h"
#include "common/testing/bad_settings.h"
#include "common/testing/process.h"
#include "proto/bridge.pb.h"
#include "proto/cognition.pb.h"
#include "proto/planner.pb.h"
#include "proto/scene.pb.h"

namespace mimesis {
namespace {
using namespace std::chrono_literals;
using testing::Process;
using testing::TestGraph;
using testing::TestNode;

/// The rest of the graph as the planner sees it: an arm that follows at once, a hand that does as
/// told.
struct Rest {
  explicit Rest(const TestGraph& graph)
      : peer(graph, {{"command", "planner/command"}, {"status", "planner/status"}},
             {{"decision", "test/decision"},
              {"scene", "test/scene"},
              {"joint_states", "test/joint_states"},
              {"hand", "test/hand"}}),
        command(peer.bus(), "command"),
        status(peer.bus(), "status"),
        decision(peer.bus(), "decision", {.latched = true}),
        scene(peer.bus(), "scene", {.latched = true}),
        arm(peer.bus(), "joint_states"),
        hand(peer.bus(), "hand"),
        q(model::load_arm("lwr4.yaml").home) {
    peer.open();
  }

  void tell(const v1::Scene& table, v1::Grip grip, v1::Transport transport, v1::Goal goal) {
    v1::Scene message = table;
    scene.send(message, TestNode::now());
    v1::Decision decided;
    decided.set_grip(grip);
    decided.set_transport(transport);
    decided.set_goal(goal);
    decided.set_settled(true);
    decided.set_decided_ns(1);
    decision.send(decided, TestNode::now());
  }
  /// Plays arm and hand until `done`.
  bool play(const std::function<bool()>& done) {
    return peer.until(
        [&] {
          while (const auto next = command.pop()) {
            ++commands;
            for (int j = 0; j < 7; ++j) q[j] = next->position_rad(j);
          }
          while (auto next = status.pop()) last = std::move(*next);
          v1::JointState arm_state;
          for (const double position : q) arm_state.add_position_rad(position);
          arm_state.set_operational(true);
          arm.send(arm_state, TestNode::now());
          v1::HandState hand_state;
          hand_state.set_active(true);
          hand.send(hand_state, TestNode::now());
          return done();
        },
        20s);
  }

  TestNode peer;
  runtime::Reliable<v1::JointCommand> command;
  runtime::Reliable<v1::TaskStatus> status;
  runtime::Out<v1::Decision> decision;
  runtime::Out<v1::Scene> scene;
  runtime::Out<v1::JointState> arm;
  runtime::Out<v1::HandState> hand;
  Eigen::VectorXd q;
  v1::TaskStatus last;
  int commands = 0;
};

std::vector<std::string> wired() {
  return {"--in",  "decision=test/decision",
          "--in",  "scene=test/scene",
          "--in",  "joint_states=test/joint_states",
          "--in",  "hand=test/hand",
          "--set", "speed=0.9",
          "--set", "upstream_s=0"};  // scene and decision are told once
}

TEST(PlannerProcess, PlansAndMovesTheArmToTheObject) {
  TestGraph graph;
  Process planner(graph, "mimesis_planner", wired());
  ASSERT_TRUE(planner.wait_ready(graph, "planner")) << planner.errors();
  Rest rest(graph);
  rest.tell(model::to_proto(model::load_table("bar_table.yaml")), v1::GRIP_FULL,
            v1::TRANSPORT_BELOW, v1::GOAL_LOW);
  const Eigen::VectorXd home = rest.q;
  ASSERT_TRUE(rest.play([&] { return rest.last.phase() == v1::TASK_PHASE_GRASP; }))
      << rest.last.ShortDebugString() << planner.errors();
  EXPECT_TRUE(rest.last.plan_succeeded());
  EXPECT_GT((rest.q - home).norm(), 0.3);
  EXPECT_GT(rest.commands, 100);
  EXPECT_EQ(planner.terminate(), 0);
}

v1::PlanRequest turned(double by_rad) {
  v1::PlanRequest asked;
  Eigen::VectorXd q = model::load_arm("lwr4.yaml").home;
  q[0] -= by_rad;
  asked.add_to()->mutable_position_rad()->Add(q.begin(), q.end());
  return asked;
}

TEST(PlannerProcess, TwoClientsQueueTheirOrdersAbortAmidAMotionAndSendTheArmHome) {
  TestGraph graph;
  Process planner(graph, "mimesis_planner", wired());
  ASSERT_TRUE(planner.wait_ready(graph, "planner")) << planner.errors();
  Rest rest(graph);
  v1::Scene scene = model::to_proto(model::load_table("bar_table.yaml"));
  rest.scene.send(scene, TestNode::now());
  const Eigen::VectorXd home = rest.q;
  TestNode one(graph, {{"answer", "planner/answer"}}, {}, "one");
  TestNode two(graph, {{"answer", "planner/answer"}}, {}, "two");
  runtime::Reliable<v1::PlanAnswer> heard_by_one(one.bus(), "answer"),
      heard_by_two(two.bus(), "answer");
  one.open();
  two.open();
  const auto ask = [](TestNode& client, const char* service, v1::PlanRequest asked) {
    asked.set_client(client.bus().node());
    v1::PlanTicket ticket;
    const auto answer = client.bus().call(service, asked.SerializeAsString(), 10s);
    EXPECT_TRUE(answer && ticket.ParseFromString(*answer)) << answer.error().reason;
    return ticket.ticket();
  };
  std::map<std::uint64_t, v1::PlanAnswer> answers, others;
  const auto answered = [&](std::size_t count) {
    return rest.play([&] {
      one.until([] { return true; }, 0ms);
      two.until([] { return true; }, 0ms);
      while (auto answer = heard_by_one.pop()) answers[answer->ticket()] = *answer;
      while (auto answer = heard_by_two.pop()) others[answer->ticket()] = *answer;
      return answers.size() >= count && others.size() >= count;
    });
  };
  EXPECT_EQ(ask(one, "planner/do", turned(0.5)), 1U);
  EXPECT_EQ(ask(two, "planner/do", turned(1.2)), 2U);
  EXPECT_EQ(ask(two, "planner/test", turned(0.7)), 3U);
  ASSERT_TRUE(answered(3)) << planner.errors();
  EXPECT_TRUE(answers[1].succeeded()) << answers[1].reason();
  EXPECT_TRUE(answers[2].succeeded()) << answers[2].reason();
  EXPECT_TRUE(answers[3].succeeded()) << answers[3].reason();
  EXPECT_EQ(answers[1].client(), "one");
  EXPECT_EQ(others[2].client(), "two");
  EXPECT_NEAR(rest.q[0], home[0] - 1.2, 1e-9);

  EXPECT_EQ(ask(one, "planner/do", turned(-0.1)), 4U);
  EXPECT_EQ(ask(two, "planner/do", turned(0.5)), 5U);
  ASSERT_TRUE(rest.play([&] { return rest.q[0] > home[0] - 0.8; })) << planner.errors();
  EXPECT_TRUE(two.bus().call("planner/abort", "", 10s));
  ASSERT_TRUE(answered(5)) << planner.errors();
  EXPECT_EQ(answers[4].reason(), "aborted");
  EXPECT_EQ(answers[5].reason(), "aborted");
  EXPECT_LT(rest.q[0], home[0] - 0.1) << "it braked amid the motion";

  EXPECT_TRUE(one.bus().call("planner/home", "", 10s));
  ASSERT_TRUE(answered(6)) << planner.errors();
  EXPECT_TRUE(answers[6].succeeded()) << answers[6].reason();
  EXPECT_LT((rest.q - home).norm(), 1e-9);
  EXPECT_EQ(planner.terminate(), 0);
}

TEST(PlannerProcess, AnUnreachableGoalFailsWithItsReason) {
  TestGraph graph;
  Process planner(graph, "mimesis_planner", wired());
  ASSERT_TRUE(planner.wait_ready(graph, "planner")) << planner.errors();
  Rest rest(graph);
  v1::Scene scene = model::to_proto(model::load_table("bar_table.yaml"));
  scene.mutable_goals(0)->mutable_position_in_world_m()->set_x_m(3.0);
  rest.tell(scene, v1::GRIP_PRECISION, v1::TRANSPORT_ABOVE, v1::GOAL_HIGH);
  ASSERT_TRUE(rest.play([&] { return rest.last.state() == v1::TASK_STATE_FAILED; }))
      << planner.errors();
  EXPECT_EQ(rest.last.reason(), "no posture reaches the high goal");
  EXPECT_EQ(planner.terminate(), 0);
}

TEST(PlannerProcess, BadConfigurationIsNamedAndExitsWith2) {
  testing::refuses("mimesis_planner", {"sped=0.5"}, "sped");
  testing::refuses("mimesis_planner", {"speed=2"}, "speed");
  testing::refuses("mimesis_planner", {"rate_hz=100"}, "planner.rate_hz: 100 contradicts");
  testing::refuses("mimesis_planner", {"robot=nowhere.yaml"}, "nowhere.yaml");
}

}  // namespace
}  // namespace mimesis
