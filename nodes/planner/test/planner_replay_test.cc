// With the plan computed on a thread the node's outputs are a function of its inputs and its
// record: in which step the plan was ready.
#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "common/model/files.h"
#include "common/testing/loopback.h"
#include "common/testing/outside_tape.h"
#include "nodes/planner/planner_node.h"

namespace mimesis::planner {
namespace {
using namespace std::chrono_literals;
using Outputs = std::map<std::string, std::vector<std::string>>;

/// An arm that follows at once and a hand that does as told.
class Robot {
 public:
  void send_states(testing::Loopback& graph, runtime::Time now) {
    v1::JointState arm;
    for (const double angle : q_) arm.add_position_rad(angle);
    arm.set_operational(true);
    graph.send("joint_states", arm, now);
    v1::HandState hand;
    hand.set_active(true);
    hand.set_closure(closed_ ? 0.24 : 0.0);
    hand.set_object_detected(closed_);
    graph.send("hand", hand, now);
  }
  void obey(const Outputs& outputs) {
    v1::JointCommand command;
    for (const std::string& bytes : outputs.at("command")) {
      ASSERT_TRUE(command.ParseFromString(bytes));
      q_ = Eigen::VectorXd::Map(command.position_rad().data(), command.position_rad_size());
    }
    v1::HandCommand hand;
    for (const std::string& bytes : outputs.at("hand_command")) {
      ASSERT_TRUE(hand.ParseFromString(bytes));
      closed_ = hand.closure() > 0.5;
    }
  }

 private:
  Eigen::VectorXd q_ = model::load_arm("lwr4.yaml").home;
  bool closed_ = false;
};

void send_task(testing::Loopback& graph, runtime::Time now) {
  v1::Decision decision;
  decision.set_grip(v1::GRIP_PRECISION);
  decision.set_transport(v1::TRANSPORT_ABOVE);
  decision.set_goal(v1::GOAL_HIGH);
  decision.set_settled(true);
  decision.set_decided_ns(42);
  graph.send("decision", decision, now);
  graph.send("scene", model::to_proto(model::load_table("bar_table.yaml")), now);
}

auto threads_of_this_process() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/task"), {});
}

/// The outputs of each step from a decision to the end of its task.
std::vector<Outputs> run(testing::OutsideTape& tape) {
  constexpr std::size_t kMost = 20'000, kPolls = 100;
  const auto threads = threads_of_this_process();
  testing::Loopback graph({.lockstep = false, .outside = &tape});
  PlannerNode node({.upstream_s = 0.0}, graph);  // the task is told once
  Robot robot;
  send_task(graph, 10s);
  std::vector<Outputs> steps;
  v1::TaskStatus status;
  while (steps.size() < kMost && status.state() != v1::TASK_STATE_DONE) {
    const runtime::Time now = 10s + 5ms * steps.size();
    robot.send_states(graph, now);
    node.step(now);
    steps.push_back(graph.take_all());
    robot.obey(steps.back());
    if (!steps.back()["status"].empty()) {
      EXPECT_TRUE(status.ParseFromString(steps.back()["status"].back()));
    }
    // Steps are so quick here that the planner's patience would end before the thread does.
    while (steps.size() == kPolls && threads_of_this_process() > threads) continue;
  }
  EXPECT_EQ(status.state(), v1::TASK_STATE_DONE) << status.reason();
  return steps;
}

TEST(PlannerNode, ReplayedGivesTheSameBytesWithoutAThread) {
  testing::OutsideTape tape;
  const std::vector<Outputs> live = run(tape);
  ASSERT_GT(tape.entries().size(), 2U);
  EXPECT_EQ(tape.entries().back().name, "compute_s");

  tape.rewind();
  EXPECT_EQ(run(tape), live);
  EXPECT_EQ(tape.problem(), "");
  EXPECT_TRUE(tape.at_end());
}

/// Tests: one is aborted while it builds the roadmap; of the others' deadlines one is not met. Each
/// waits for the thread.
std::vector<Outputs> run_requests(testing::OutsideTape& tape) {
  const auto threads = threads_of_this_process();
  testing::Loopback graph({.lockstep = false, .outside = &tape});
  PlannerNode node({.upstream_s = 0.0}, graph);
  Robot robot;
  graph.send("scene", model::to_proto(model::load_table("bar_table.yaml")), 10s);
  v1::PlanRequest asked;
  asked.set_grip(v1::GRIP_PRECISION);
  asked.set_transport(v1::TRANSPORT_ABOVE);
  asked.set_goal(v1::GOAL_HIGH);
  for (const double deadline_s : {0.0, 600.0, 1e-4, 600.0, 0.02}) {
    asked.set_deadline_s(deadline_s);
    EXPECT_TRUE(graph.call("test/plan", asked.SerializeAsString(), {}));
  }
  std::vector<Outputs> steps;
  for (int answers = 0; answers < 5 && steps.size() < 100'000;) {
    const runtime::Time now = 10s + 5ms * steps.size();
    if (steps.size() == 3) {
      v1::PlanTicket first;
      first.set_ticket(1);
      EXPECT_TRUE(graph.call("test/abort", first.SerializeAsString(), {}));
    }
    robot.send_states(graph, now);
    node.step(now);
    steps.push_back(graph.take_all());
    answers += static_cast<int>(steps.back()["answer"].size());
    while (steps.size() % 10 == 0 && threads_of_this_process() > threads) continue;
  }
  return steps;
}

TEST(PlannerNode, DeadlinesOfRequestsAreReplayed) {
  testing::OutsideTape tape;
  const std::vector<Outputs> live = run_requests(tape);
  std::vector<v1::PlanAnswer> answers;
  for (const Outputs& step : live) {
    const auto given = step.find("answer");
    if (given == step.end()) continue;
    for (const std::string& bytes : given->second) {
      ASSERT_TRUE(answers.emplace_back().ParseFromString(bytes));
    }
  }
  ASSERT_EQ(answers.size(), 5u);
  EXPECT_EQ(answers[0].reason(), "aborted");
  EXPECT_TRUE(answers[1].succeeded()) << answers[1].reason();
  EXPECT_TRUE(answers[2].reason().starts_with("the deadline of 0.0001 s passed while "))
      << answers[2].reason();
  EXPECT_TRUE(answers[3].succeeded()) << answers[3].reason();

  tape.rewind();
  EXPECT_EQ(run_requests(tape), live);
  EXPECT_EQ(tape.problem(), "");
  EXPECT_TRUE(tape.at_end());
}

TEST(Job, TakesReadinessFromTheRecordAndReportsAnother) {
  testing::OutsideTape tape;
  tape.entries() = {{"job", {'\0'}, false}, {"job", {'\1'}, false}, {"can", {'\1'}, false}};
  tape.rewind();
  testing::Loopback graph({.lockstep = false, .outside = &tape});
  runtime::Job<std::thread::id> job(graph);
  EXPECT_FALSE(job.take()) << "nothing runs: nothing is read";
  job.start([] { return std::this_thread::get_id(); });
  EXPECT_FALSE(job.take());
  EXPECT_TRUE(job.running());
  EXPECT_EQ(job.take(), std::this_thread::get_id()) << "a replay has no threads";
  EXPECT_FALSE(job.running());
  job.start([] { return std::this_thread::get_id(); });
  EXPECT_FALSE(job.take());
  EXPECT_EQ(tape.problem(), "entry 2: the node has read 'job', the record read 'can'");
}

}  // namespace
}  // namespace mimesis::planner
