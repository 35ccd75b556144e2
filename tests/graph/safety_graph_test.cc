// A node of the running imitation is killed (vision: tests/safety): the arm stops, the launcher
// fails, nothing stays behind.
#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>

#include "common/machine_time.h"
#include "common/model/files.h"
#include "hw/sim/world/collisions.h"
#include "proto/bridge.pb.h"
#include "proto/planner.pb.h"
#include "proto/world.pb.h"
#include "tests/graph/scenario.h"

namespace mimesis::testing {
namespace {

class KilledNode : public ::testing::TestWithParam<const char*> {
 protected:
  /// Until the arm moves.
  static bool wait_executing(Scenario& run) {
    runtime::Tap tap(
        run.graph().name(), [](const std::string& topic) { return topic == "planner/status"; },
        runtime::Policy::reliable);
    while (!run.process().wait(0ms)) {  // in lock-step the run ends, moved or not
      const auto item = tap.next(100ms);
      v1::TaskStatus status;
      if (item && status.ParseFromString(item->message.payload) &&
          status.state() == v1::TASK_STATE_EXECUTING) {
        return true;
      }
    }
    return false;
  }

  static std::map<std::string, pid_t> pids(const Scenario& run) {
    std::map<std::string, pid_t> found;
    for (const v1::NodeInfo& node : runtime::GraphView(run.graph().name()).nodes()) {
      found[node.name()] = static_cast<pid_t>(node.pid());
    }
    return found;
  }
};

TEST_P(KilledNode, StopsTheArmAndLeavesNothingBehind) {
  const std::string victim = GetParam();
  Scenario run("imitation",
               victim == "camera" ? std::vector<std::string>{} : played("precision_above_high"));
  ASSERT_TRUE(wait_executing(run)) << run.process().errors();
  const auto before = pids(run);
  ASSERT_TRUE(before.contains(victim));
  kill(before.at(victim), SIGKILL);

  const auto code = run.wait();
  ASSERT_TRUE(code.has_value()) << "the launcher did not end";
  EXPECT_NE(*code, 0);
  EXPECT_NE(run.process().errors().find(victim), std::string::npos) << "the line names who died";
  const nlohmann::json result = run.result();
  ASSERT_TRUE(result.is_object()) << run.process().output();
  EXPECT_EQ(result["success"], false);
  EXPECT_FALSE(result["reason"].get<std::string>().empty());
  for (const auto& [name, pid] : before) {
    if (pid == getpid()) continue;  // this test's own tap
    EXPECT_NE(kill(pid, 0), 0) << name << " still runs";
  }

  if (victim == "sim_drives") return;  // the arm itself is gone
  if (victim == "clock") return;       // simulated time stands still, and the arm with it
  const auto states = run.messages("sim_drives/joint_states");
  ASSERT_FALSE(states.empty());
  v1::JointState last;
  ASSERT_TRUE(last.ParseFromString(states.back().payload));
  for (int i = 0; i < last.drives_size(); ++i) {
    EXPECT_NEAR(last.velocity_rad_s(i), 0.0, 1e-3) << "axis " << i << " still moves";
    EXPECT_NE(last.drives(i), v1::DRIVE_STATE_OPERATION_ENABLED)
        << "axis " << i << " is still powered";
  }

  if (victim != "world") {
    const auto worlds = run.messages("world/state");
    ASSERT_FALSE(worlds.empty());
    v1::WorldState world;
    ASSERT_TRUE(world.ParseFromString(worlds.back().payload));
    EXPECT_EQ(world.collisions(), 0U) << world.last_collision();
  }
  // The launcher ends the world before the drives: the arm's last way is judged here.
  const std::string models = MIMESIS_SOURCE_DIR "/models/";
  const kin::ArmModel arm = model::load_arm(models + "lwr4.yaml");
  world::CollisionMonitor contacts(arm, model::load_table(models + "bar_table.yaml"));
  std::vector<Eigen::Isometry3d> frames;
  for (const auto& message : states) {
    v1::JointState state;
    ASSERT_TRUE(state.ParseFromString(message.payload));
    ASSERT_EQ(state.position_rad_size(), arm.dof());
    kin::forward(arm, Eigen::Map<const Eigen::VectorXd>(state.position_rad().data(), arm.dof()),
                 frames);
    contacts.update(frames, {.cylinder = {}, .falling = true});
  }
  EXPECT_EQ(contacts.count(), 0) << contacts.last();
}

INSTANTIATE_TEST_SUITE_P(Nodes, KilledNode,
                         ::testing::Values("camera", "cognition", "planner", "bridge", "sim_drives",
                                           "sim_hand", "world", "clock"),
                         [](const auto& node) { return std::string(node.param); });

TEST(KilledLauncher, LeavesNothingBehind) {
  Scenario run("imitation", played("precision_above_high"));
  runtime::GraphView view(run.graph().name());
  while (view.nodes().size() < 5 && !run.process().wait(0ms)) view.wait(100ms);
  const auto nodes = view.nodes();
  run.process().signal(SIGKILL);
  run.process().wait();
  MachineTime time;
  while (time.passed() < 20s && !view.nodes().empty()) view.wait(100ms);
  for (const v1::NodeInfo& node : nodes) {
    const auto pid = static_cast<pid_t>(node.pid());
    while (time.passed() < 30s && kill(pid, 0) == 0) view.wait(50ms);
    EXPECT_NE(kill(pid, 0), 0) << node.name() << " still runs";
  }
}

}  // namespace
}  // namespace mimesis::testing
