#include "hw/sim/world/world_node.h"

#include <gtest/gtest.h>

#include "common/error.h"
#include "common/model/files.h"
#include "common/testing/loopback.h"
#include "hw/sim/world/test/postures.h"

namespace mimesis::world {
namespace {

using namespace std::chrono_literals;

constexpr runtime::Time kStep = 10ms;
const std::string kModels = std::string(MIMESIS_SOURCE_DIR) + "/models/";

WorldParams params() {
  WorldParams p;
  p.robot = kModels + "lwr4.yaml";
  p.table = kModels + "bar_table.yaml";
  p.settle_s = p.retry_s = 0.1;
  return p;
}

class WorldNodeTest : public ::testing::Test {
 protected:
  explicit WorldNodeTest(const WorldParams& p = params())
      : arm_(model::load_arm(p.robot)),
        table_(model::load_table(p.table)),
        search_(arm_, table_),
        node_(p, bus_) {}

  void step(int times = 1) {
    for (int i = 0; i < times; ++i) node_.step(now_ += kStep);
  }
  void send_arm(const Eigen::VectorXd& q) {
    v1::JointState state;
    for (const double x : q) state.add_position_rad(x);
    bus_.send("joint_states", state, now_ + kStep);
  }
  void send_hand(v1::Grip grip, double closure) {
    v1::HandState state;
    state.set_grip(grip);
    state.set_closure(closure);
    bus_.send("hand", state, now_ + kStep);
  }
  void send_task(v1::TaskState state, v1::Goal goal, const std::string& reason = "") {
    v1::TaskStatus status;
    status.set_state(state);
    status.set_goal(goal);
    status.set_reason(reason);
    bus_.send("task", status, now_ + kStep);
  }
  /// One step with the arm at `q` and a hand in precision mode.
  void act(const Eigen::VectorXd& q, double closure, int times = 1) {
    for (int i = 0; i < times; ++i) {
      send_arm(q);
      send_hand(v1::GRIP_PRECISION, closure);
      step();
    }
  }

  testing::Loopback bus_;
  kin::ArmModel arm_;
  kin::Table table_;
  PostureSearch search_;
  WorldNode node_;
  runtime::Time now_ = 1s;
};

TEST_F(WorldNodeTest, TellsTheSceneAgainAndAgainAndTheStateAlways) {
  step(2);
  const auto scene = bus_.take<v1::Scene>("scene");
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->boxes_size(), 4);
  EXPECT_EQ(scene->boxes(0).name(), "table top");
  EXPECT_DOUBLE_EQ(scene->object().position_in_world_m().x_m(), table_.object.x());
  EXPECT_FALSE(bus_.take<v1::Scene>("scene"));
  EXPECT_TRUE(bus_.take<foxglove::SceneUpdate>("entities"));
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(bus_.take<v1::WorldState>("state"));
  step(300);
  int again = 0;
  while (const auto next = bus_.take<v1::Scene>("scene")) {
    EXPECT_EQ(next->object().ShortDebugString(), scene->object().ShortDebugString());
    ++again;
  }
  EXPECT_EQ(again, 150) << "every 20 ms";
}

TEST_F(WorldNodeTest, APlacedObjectIsJudgedOnceAndMovesTheScene) {
  const Reach grasp = search_.grasps(Grip::precision, 200).at(0);
  const Reach place = search_.places(Grip::precision, 200, table_.goals[0].position).at(0);
  act(grasp.at, 0.0);
  const auto contact = bus_.take_last<v1::HandContact>("contact");
  ASSERT_TRUE(contact && contact->reachable());
  EXPECT_NEAR(contact->contact_closure(), 1 - 0.044 / 0.058, 1e-9);
  send_task(v1::TASK_STATE_EXECUTING, v1::GOAL_HIGH);
  act(grasp.at, contact->contact_closure());
  EXPECT_TRUE(bus_.take_last<v1::WorldState>("state")->grasped());
  act(place.at, contact->contact_closure());
  act(place.at, 0.0, 10);
  act(place.before, 0.0);
  bus_.take_last<v1::Scene>("scene");
  EXPECT_FALSE(bus_.take<v1::TrialOutcome>("outcome"));
  send_task(v1::TASK_STATE_DONE, v1::GOAL_HIGH);
  act(arm_.home, 0.0, 10);
  EXPECT_FALSE(bus_.take<v1::TrialOutcome>("outcome"));  // settle_s has not passed
  act(arm_.home, 0.0, 10);
  const auto outcome = bus_.take<v1::TrialOutcome>("outcome");
  ASSERT_TRUE(outcome);
  EXPECT_TRUE(outcome->placed()) << outcome->reason();
  EXPECT_EQ(outcome->goal(), v1::GOAL_HIGH);
  EXPECT_LT(outcome->placement_error_m(), 1e-3);
  EXPECT_EQ(outcome->collisions(), 0u);
  EXPECT_TRUE(outcome->success());
  EXPECT_FALSE(bus_.take<v1::TrialOutcome>("outcome"));
}

TEST_F(WorldNodeTest, APlacedObjectThatTouchedSomethingOnTheWayIsNoSuccess) {
  const Reach grasp = search_.grasps(Grip::precision, 200).at(0);
  const Reach place = search_.places(Grip::precision, 200, table_.goals[0].position).at(0);
  act(grasp.at, 0.0);
  send_task(v1::TASK_STATE_EXECUTING, v1::GOAL_HIGH);
  act(grasp.at, 0.3);
  for (double share = 0.0; share < 1.0; share += 0.05)  // straight on, not around the bar
    act(grasp.at + share * (place.at - grasp.at), 0.3);
  act(place.at, 0.3);
  act(place.at, 0.0, 10);
  act(place.before, 0.0);
  send_task(v1::TASK_STATE_DONE, v1::GOAL_HIGH);
  act(arm_.home, 0.0, 20);
  const auto outcome = bus_.take<v1::TrialOutcome>("outcome");
  ASSERT_TRUE(outcome);
  EXPECT_TRUE(outcome->placed());
  EXPECT_GT(outcome->collisions(), 0u);
  EXPECT_FALSE(outcome->success());
  EXPECT_NE(outcome->reason().find(", the last: "), std::string::npos);
}

TEST_F(WorldNodeTest, TheSceneFollowsTheObjectWhenItRests) {
  const Reach grasp = search_.grasps(Grip::precision, 200).at(0);
  act(grasp.at, 0.0);
  const auto before = bus_.take_last<v1::Scene>("scene");
  ASSERT_TRUE(before);
  act(grasp.at, 0.3);
  act(grasp.before, 0.3);
  const auto still = bus_.take_last<v1::Scene>("scene");
  ASSERT_TRUE(still);  // not measured while it moves
  EXPECT_EQ(still->object().ShortDebugString(), before->object().ShortDebugString());
  act(grasp.before, 0.0, 100);  // falls 10 cm and lies on the plinth
  const auto scene = bus_.take_last<v1::Scene>("scene");
  ASSERT_TRUE(scene);
  EXPECT_NEAR(scene->object().position_in_world_m().z_m(), 0.03 + table_.object_radius, 1e-9);
  const auto state = bus_.take_last<v1::WorldState>("state");
  EXPECT_TRUE(state->dropped() && state->moved() && !state->grasped());
}

TEST_F(WorldNodeTest, AFailedTaskIsJudgedWithThePlannersReason) {
  act(arm_.home, 0.0);
  send_task(v1::TASK_STATE_EXECUTING, v1::GOAL_HIGH);
  send_task(v1::TASK_STATE_FAILED, v1::GOAL_UNSPECIFIED, "goal high is blocked");
  act(arm_.home, 0.0, 20);
  const auto outcome = bus_.take<v1::TrialOutcome>("outcome");
  ASSERT_TRUE(outcome);
  EXPECT_FALSE(outcome->placed());
  EXPECT_EQ(outcome->reason(), "goal high is blocked");
  EXPECT_EQ(outcome->goal(), v1::GOAL_HIGH);  // the one decided before
}

TEST_F(WorldNodeTest, AFailureLeavesTimeForAnotherDecision) {
  WorldParams p = params();
  p.retry_s = 1.0;
  testing::Loopback bus;
  WorldNode patient(p, bus);
  v1::TaskStatus failed;
  failed.set_state(v1::TASK_STATE_FAILED);
  bus.send("task", failed, 1s);
  Time now = 1s;
  for (; now < Time(1950ms); now += 10ms) patient.step(now);
  EXPECT_FALSE(bus.take<v1::TrialOutcome>("outcome"));
  for (; now < Time(2050ms); now += 10ms) patient.step(now);
  EXPECT_TRUE(bus.take<v1::TrialOutcome>("outcome"));
}

TEST_F(WorldNodeTest, ATaskThatStartsAgainIsNotJudgedYet) {
  send_task(v1::TASK_STATE_FAILED, v1::GOAL_HIGH, "first try");
  step();
  send_task(v1::TASK_STATE_PLANNING, v1::GOAL_HIGH);
  step(50);
  EXPECT_FALSE(bus_.take<v1::TrialOutcome>("outcome"));
  send_task(v1::TASK_STATE_DONE, v1::GOAL_HIGH);
  step(20);
  const auto outcome = bus_.take<v1::TrialOutcome>("outcome");
  ASSERT_TRUE(outcome);
  EXPECT_EQ(outcome->reason(), "object not grasped");
}

TEST_F(WorldNodeTest, WithoutArmOrHandThereIsNoContact) {
  step();
  EXPECT_FALSE(bus_.take_last<v1::HandContact>("contact")->reachable());
  send_hand(v1::GRIP_PRECISION, 1.0);
  step(10);
  EXPECT_FALSE(bus_.take_last<v1::WorldState>("state")->grasped());
  EXPECT_EQ(bus_.take_last<foxglove::FrameTransforms>("transforms")->transforms_size(), 3);
}

TEST_F(WorldNodeTest, StaleStatesSilenceTheContact) {
  const Reach grasp = search_.grasps(Grip::precision, 200).at(0);
  act(grasp.at, 0.0);
  step(20);  // 0.2 s without news: still fresh
  EXPECT_TRUE(bus_.take_last<v1::HandContact>("contact")->reachable());
  step();
  EXPECT_FALSE(bus_.take_last<v1::HandContact>("contact")->reachable());
}

TEST_F(WorldNodeTest, WrongSizeAndNaNAreNotPostures) {
  const Reach grasp = search_.grasps(Grip::precision, 200).at(0);
  act(grasp.at, 0.0);
  send_arm(Eigen::VectorXd::Zero(6));
  step();
  EXPECT_TRUE(bus_.take_last<v1::HandContact>("contact")->reachable());  // where it was seen last
  Eigen::VectorXd bad = arm_.home;
  bad[3] = NAN;
  send_arm(bad);
  step();
  EXPECT_EQ(bus_.counters("joint_states").rejected, 1u);
  EXPECT_TRUE(bus_.take_last<v1::HandContact>("contact")->reachable());
}

TEST_F(WorldNodeTest, TimeThatDoesNotAdvanceDoesNothing) {
  step();
  bus_.take_last<v1::WorldState>("state");
  node_.step(now_);
  EXPECT_FALSE(bus_.take<v1::WorldState>("state"));
}

TEST(WorldNodeParams, ABlockedGoalIsAnObstacleEverybodySees) {
  WorldParams p = params();
  p.goal_blocked = "low";
  p.bar_height_m = 0.3;
  p.object_offset_m = {0.01, -0.02};
  testing::Loopback bus;
  WorldNode node(p, bus);
  node.step(1s);
  const auto scene = bus.take<v1::Scene>("scene");
  ASSERT_EQ(scene->boxes_size(), 5);
  EXPECT_EQ(scene->boxes(4).name(), "block on goal low");
  EXPECT_DOUBLE_EQ(scene->boxes(4).center_in_world_m().y_m(), 0.12);
  EXPECT_DOUBLE_EQ(scene->bar().height_m(), 0.3);
  EXPECT_DOUBLE_EQ(scene->object().position_in_world_m().x_m(), 0.41);
}

TEST(WorldNodeParams, ARandomSceneKeepsThingsOnWhatCarriesThem) {
  const kin::Table usual = model::load_table(params().table);
  const auto table = [](int seed) {
    WorldParams p = params();
    p.scene = "random";
    p.seed = seed;
    testing::Loopback bus;
    WorldNode node(p, bus);
    node.step(1s);
    return model::from_proto(*bus.take<v1::Scene>("scene"));
  };
  double widest = 0.0;
  for (int seed = 0; seed < 30; ++seed) {
    const kin::Table t = table(seed);
    EXPECT_TRUE(t.object.head<2>().isApprox(t.boxes[1].center.head<2>() +
                                            (usual.object - usual.boxes[1].center).head<2>()));
    for (std::size_t i = 0; i < t.goals.size(); ++i) {
      const kin::Box& stand = t.boxes[2 + i];
      const auto above = [](const kin::Table& of, std::size_t k) -> Eigen::Vector3d {
        return of.goals[k].position - of.boxes[2 + k].center -
               of.boxes[2 + k].half_extent.z() * Eigen::Vector3d::UnitZ();
      };
      EXPECT_TRUE(above(t, i).isApprox(above(usual, i), 1e-9)) << stand.name;
      EXPECT_NEAR(stand.center.z() - stand.half_extent.z(), -0.01, 1e-12);
      const double aside = (t.goals[i].position - usual.goals[i].position).cwiseAbs().maxCoeff();
      EXPECT_LE(aside, 0.015);
      widest = std::max(widest, aside);
    }
  }
  EXPECT_GT(widest, 0.013);
  EXPECT_EQ(table(7).object, table(7).object);
  EXPECT_NE(table(7).object, table(8).object);
}

TEST(WorldNodeParams, AMissingFileIsAConfigurationError) {
  WorldParams p = params();
  p.table = "no-such-table.yaml";
  testing::Loopback bus;
  EXPECT_THROW(WorldNode(p, bus), ConfigError);
}

}  // namespace
}  // namespace mimesis::world
