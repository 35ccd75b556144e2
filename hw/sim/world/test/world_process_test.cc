#include <gtest/gtest.h>

#include "common/model/files.h"
#include "common/testing/bad_settings.h"
#include "common/testing/process.h"
#include "hw/sim/world/test/postures.h"
#include "proto/bridge.pb.h"
#include "proto/planner.pb.h"
#include "proto/world.pb.h"

namespace mimesis::world {
namespace {

using testing::Process;
using testing::TestGraph;
using testing::TestNode;

constexpr const char* kWorld = "mimesis_world";

/// Plays drives, hand and planner for the real program.
class WorldProcess : public ::testing::Test {
 protected:
  WorldProcess()
      : peer_(
            graph_,
            {{"scene", "world/scene"},
             {"state", "world/state"},
             {"contact", "world/contact"},
             {"outcome", "world/outcome"}},
            {{"joint_states", "test/joint_states"}, {"hand", "test/hand"}, {"task", "test/task"}}),
        scene_(peer_.bus(), "scene"),
        state_(peer_.bus(), "state"),
        contact_(peer_.bus(), "contact"),
        outcome_(peer_.bus(), "outcome"),
        arm_(peer_.bus(), "joint_states"),
        hand_(peer_.bus(), "hand"),
        task_(peer_.bus(), "task"),
        model_(model::load_arm("lwr4.yaml")),
        table_(model::load_table("bar_table.yaml")),
        search_(model_, table_) {
    peer_.open();
  }

  std::unique_ptr<Process> start(std::vector<std::string> arguments = {}) {
    for (const char* wire :
         {"joint_states=test/joint_states", "hand=test/hand", "task=test/task"}) {
      arguments.insert(arguments.end(), {"--in", wire});
    }
    auto process = std::make_unique<Process>(graph_, kWorld, std::move(arguments));
    EXPECT_TRUE(process->wait_ready(graph_, "world")) << process->errors();
    EXPECT_TRUE(peer_.wait_subscriber(arm_) && peer_.wait_subscriber(hand_) &&
                peer_.wait_subscriber(task_));
    return process;
  }
  /// Keeps sending posture and hand until `done`.
  bool hold(const Eigen::VectorXd& q, double closure, const std::function<bool()>& done) {
    v1::JointState arm;
    for (const double x : q) arm.add_position_rad(x);
    v1::HandState hand;
    hand.set_grip(v1::GRIP_PRECISION);
    hand.set_closure(closure);
    return peer_.until([&] {
      arm_.send(arm, TestNode::now());
      hand_.send(hand, TestNode::now());
      return done();
    });
  }
  void send_task(v1::TaskState state, const std::string& reason = "") {
    v1::TaskStatus status;
    status.set_state(state);
    status.set_goal(v1::GOAL_HIGH);
    status.set_reason(reason);
    task_.send(status, TestNode::now());
  }

  TestGraph graph_;
  TestNode peer_;
  runtime::Reliable<v1::Scene> scene_;
  runtime::Latest<v1::WorldState> state_;
  runtime::Latest<v1::HandContact> contact_;
  runtime::Reliable<v1::TrialOutcome> outcome_;
  runtime::Out<v1::JointState> arm_;
  runtime::Out<v1::HandState> hand_;
  runtime::Out<v1::TaskStatus> task_;
  kin::ArmModel model_;
  kin::Table table_;
  PostureSearch search_;
};

TEST_F(WorldProcess, JudgesATrialThatSucceeds) {
  const auto process = start({"--set", "settle_s=0.1"});
  const auto scene = peer_.receive(scene_);
  ASSERT_TRUE(scene) << process->errors();
  EXPECT_EQ(scene->goals_size(), 2);

  const Reach grasp = search_.grasps(Grip::precision, 200).at(0);
  const Reach place = search_.places(Grip::precision, 200, table_.goals[0].position).at(0);
  ASSERT_TRUE(hold(grasp.at, 0.0, [&] { return contact_.get() && contact_.get()->reachable(); }));
  const double closure = contact_.get()->contact_closure();
  ASSERT_TRUE(hold(grasp.at, closure, [&] { return state_.get()->grasped(); }));
  const auto lifted = [&] {
    return state_.get()->object_position_in_world_m().z_m() > table_.goals[0].position.z();
  };
  ASSERT_TRUE(hold(place.at, closure, lifted));
  ASSERT_TRUE(hold(place.at, 0.0, [&] { return !state_.get()->grasped(); }));
  send_task(v1::TASK_STATE_DONE);
  std::optional<v1::TrialOutcome> outcome;
  ASSERT_TRUE(hold(model_.home, 0.0, [&] { return (outcome = outcome_.pop()).has_value(); }));
  EXPECT_TRUE(outcome->placed()) << outcome->reason();
  EXPECT_LT(outcome->placement_error_m(), 1e-3);
  EXPECT_EQ(process->terminate(), 0);
}

TEST_F(WorldProcess, JudgesATrialThatFails) {
  const auto process =
      start({"--set", "settle_s=0", "--set", "retry_s=0", "--set", "goal_blocked=high"});
  const auto scene = peer_.receive(scene_);
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->boxes(scene->boxes_size() - 1).name(), "block on goal high");
  send_task(v1::TASK_STATE_FAILED, "no posture reaches goal high");
  const auto outcome = peer_.receive(outcome_);
  ASSERT_TRUE(outcome);
  EXPECT_FALSE(outcome->placed());
  EXPECT_EQ(outcome->reason(), "no posture reaches goal high");
  EXPECT_EQ(process->terminate(), 0);
}

TEST(WorldProcessMistakes, BadParametersExitWith2AndTheKeysName) {
  testing::refuses(kWorld, {"goal_blocked=middle"}, "goal_blocked");
  testing::refuses(kWorld, {"table=nowhere.yaml"}, "nowhere.yaml");
}

}  // namespace
}  // namespace mimesis::world
