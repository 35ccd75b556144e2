#include "nodes/planner/task_sequence.h"

#include <gtest/gtest.h>

#include <functional>

namespace mimesis::planner {
namespace {

using State = TaskSequence::State;

Eigen::VectorXd both(double q) { return Eigen::VectorXd::Constant(2, q); }

PlannedMotion motion(Phase phase, double from, double to) {
  const SmoothPath path({both(from), both(to)}, 0.1, [](const Eigen::MatrixXd&) { return true; });
  return {phase, path.curves(), {}, time_optimal(path, both(1.0), both(4.0), 0.005)};
}

/// reach 0 -> 1, approach 1 -> 1.2, transport 1.2 -> 1.3 -> 2, retreat 2 -> 1.9 [rad]
TaskPlan small_plan() {
  TaskPlan plan;
  plan.motions = {motion(Phase::reach, 0.0, 1.0), motion(Phase::approach, 1.0, 1.2),
                  motion(Phase::transport, 1.2, 1.3), motion(Phase::transport, 1.3, 2.0),
                  motion(Phase::retreat, 2.0, 1.9)};
  plan.path_length_rad = 2.1;
  return plan;
}

/// A task with an arm that follows at once and a hand that takes 20 steps.
class Trial {
 public:
  Trial()
      : sequence({.a_max_rad_s2 = both(4.0),
                  .keeps_clear = [](const TaskPlan&, std::size_t, const kin::Table& planned,
                                    const kin::Table& now) {
                    return now.balls.size() == planned.balls.size();
                  }}) {
    decision.id = 7;
    arm.q = both(0.0);
    arm.operational = true;
    hand.active = true;
    table.object = {0.4, 0.0, 0.1};
  }

  void step() {
    sequence.step({decided ? &decision : nullptr, has_table ? &table : nullptr,
                   has_arm ? &arm : nullptr, has_hand ? &hand : nullptr, missing, periods,
                   std::exchange(abort, false)});
    if (const auto request = sequence.take_request()) {
      requests.push_back(*request);
      if (answer) sequence.set_plan(answer());
    }
    if (const auto& point = sequence.set_point(); point && follows) arm.q = point->q;
    if (const auto& order = sequence.hand_order()) move_hand(order->closure);
    if (phases.empty() || phases.back() != sequence.phase()) phases.push_back(sequence.phase());
  }
  /// Steps until `done` or 5000 steps have passed.
  void until(const std::function<bool()>& done) {
    for (int i = 0; i < 5000 && !done(); ++i) step();
  }
  void until_rest() {
    until([&] { return sequence.state() == State::done || sequence.state() == State::failed; });
  }
  void until_phase(Phase phase) {
    until([&] { return sequence.state() == State::executing && sequence.phase() == phase; });
  }

  TaskSequence sequence;
  Order decision{Task{}};
  kin::Table table;
  ArmReading arm;
  HandReading hand;
  bool decided = true, has_table = true, has_arm = true, has_hand = true, follows = true;
  bool object_there = true, abort = false;
  std::string missing;
  int periods = 1;
  std::function<tl::expected<TaskPlan, Status>()> answer = [] { return small_plan(); };
  std::vector<PlanRequest> requests;
  std::vector<Phase> phases;

 private:
  void move_hand(double closure) {
    const double end =
        closure > 0.5 && object_there ? 0.3 : closure;  // fingers meet the object at 0.3
    const double step = std::clamp(end - hand.closure, -0.05, 0.05);
    hand.closure += step;
    hand.moving = std::abs(step) > 1e-9;
    hand.object_detected = object_there && closure > 0.5 && !hand.moving;
  }
};

TEST(TaskSequence, GoesThroughAllPhasesOnceTheDecisionHasSettled) {
  Trial trial;
  trial.decided = false;
  for (int i = 0; i < 100; ++i) trial.step();
  EXPECT_EQ(trial.sequence.state(), State::idle);
  EXPECT_FALSE(trial.sequence.set_point()) << "silent before the first decision";
  trial.decided = true;
  trial.until_rest();
  EXPECT_EQ(trial.sequence.state(), State::done) << trial.sequence.reason();
  EXPECT_EQ(trial.phases, (std::vector{Phase::reach, Phase::approach, Phase::grasp,
                                       Phase::transport, Phase::release, Phase::retreat}));
  EXPECT_TRUE(trial.sequence.plan_succeeded());
  EXPECT_EQ(trial.requests.size(), 1u);
  EXPECT_LT((trial.arm.q - both(1.9)).norm(), 1e-12);
  EXPECT_EQ(trial.hand.closure, 0.0);
  for (int i = 0; i < 100; ++i) trial.step();
  EXPECT_EQ(trial.requests.size(), 1u) << "one task per decision";
}

TEST(TaskSequence, SetPointsNeverJump) {
  Trial trial;
  Eigen::VectorXd last = both(0.0);
  trial.until([&] {
    if (const auto& point = trial.sequence.set_point()) {
      EXPECT_LT((point->q - last).cwiseAbs().maxCoeff(), 1.01 * 0.005);  // 1 rad/s
      last = point->q;
    }
    return trial.sequence.state() == State::done;
  });
  EXPECT_EQ(trial.sequence.state(), State::done);
}

TEST(TaskSequence, HoldsThePostureAndTheHandOpenWhileItPlans) {
  Trial trial;
  trial.answer = nullptr;
  trial.arm.q = both(0.3);
  trial.step();
  EXPECT_EQ(trial.sequence.state(), State::planning);
  ASSERT_TRUE(trial.sequence.set_point());
  EXPECT_EQ(trial.sequence.set_point()->q, both(0.3));
  EXPECT_EQ(trial.sequence.set_point()->dq, both(0.0));
  EXPECT_EQ(trial.sequence.hand_order()->closure, 0.0);
  EXPECT_FALSE(trial.sequence.plan_succeeded());
  EXPECT_EQ(trial.requests.at(0).start, both(0.3));
}

TEST(TaskSequence, ANewDecisionAfterAFailedPlanStartsAgain) {
  Trial trial;
  trial.answer = []() -> tl::expected<TaskPlan, Status> {
    return tl::unexpected(Status{"no way"});
  };
  trial.until_rest();
  EXPECT_EQ(trial.sequence.state(), State::failed);
  EXPECT_EQ(trial.sequence.reason(), "no way");
  EXPECT_FALSE(trial.sequence.plan_succeeded());
  EXPECT_TRUE(trial.sequence.set_point()) << "the arm is well and held";
  trial.answer = [] { return small_plan(); };
  for (int i = 0; i < 10; ++i) trial.step();
  EXPECT_EQ(trial.sequence.state(), State::failed) << "the same decision is not tried twice";
  trial.decision.id = 8;
  trial.step();
  trial.until_rest();
  EXPECT_EQ(trial.sequence.state(), State::done);
  EXPECT_EQ(trial.sequence.reason(), "");
}

TEST(TaskSequence, FaultsSilenceTheSetPoints) {
  struct Case {
    const char* reason;
    std::function<void(Trial&)> happen;
  };
  const std::vector<Case> cases{
      {"arm: axis 3 in FAULT", [](Trial& t) { t.arm.fault = "axis 3 in FAULT"; }},
      {"hand: overheated", [](Trial& t) { t.hand.fault = "overheated"; }},
      {"the arm's state is stale", [](Trial& t) { t.has_arm = false; }},
      {"the hand's state is stale", [](Trial& t) { t.has_hand = false; }},
      {"the arm is no longer operational", [](Trial& t) { t.arm.operational = false; }},
      {"the hand is not active", [](Trial& t) { t.hand.active = false; }},
      {"joint 2 is 29 deg off its set-point",
       [](Trial& t) {
         t.follows = false;
         t.arm.q[1] -= 0.5;
       }},
  };
  for (const auto& [reason, happen] : cases) {
    Trial trial;
    trial.until_phase(Phase::transport);
    happen(trial);
    trial.step();
    EXPECT_EQ(trial.sequence.state(), State::failed) << reason;
    EXPECT_EQ(trial.sequence.reason(), reason);
    EXPECT_FALSE(trial.sequence.set_point()) << reason;
  }
}

TEST(TaskSequence, ClosingOnNothingFails) {
  Trial trial;
  trial.object_there = false;
  trial.until_rest();
  EXPECT_EQ(trial.sequence.reason(), "the hand closed, but no object was detected");
  EXPECT_TRUE(trial.sequence.set_point());
}

TEST(TaskSequence, ALostObjectBrakesTheArmBeforeItFails) {
  Trial trial;
  trial.until_phase(Phase::transport);
  trial.until([&] { return trial.sequence.set_point()->dq.norm() > 0.5; });
  trial.object_there = false;
  double last = trial.arm.q[0];
  trial.until([&] {
    const double moved = trial.arm.q[0] - last;
    last = trial.arm.q[0];
    EXPECT_LT(moved, 0.0051);
    return trial.sequence.state() == State::failed;
  });
  EXPECT_EQ(trial.sequence.reason(), "the object was lost in transport");
  EXPECT_LT(trial.arm.q[0], 2.0);
}

TEST(TaskSequence, WaitsOnItsPathForWhatIsMissingAndGoesOn) {
  Trial trial;
  trial.until([&] { return trial.arm.q[0] > 0.4; });
  trial.missing = "the scene";
  for (int i = 0; i < 60; ++i) trial.step();  // 0.3 s
  const Eigen::VectorXd waits = trial.arm.q;
  EXPECT_LT(waits[0], 0.4 + 0.005 + 1.0 / (2.0 * 4.0) + 0.01);
  EXPECT_EQ(trial.sequence.reason(), "waits for the scene");
  for (int i = 0; i < 60; ++i) trial.step();
  EXPECT_EQ(trial.arm.q, waits);
  trial.missing.clear();
  trial.until_rest();
  EXPECT_EQ(trial.sequence.state(), State::done);
  EXPECT_EQ(trial.sequence.reason(), "");
  EXPECT_EQ(trial.requests.size(), 1u) << "it is the same plan";
}

/// An arm that can do only half of the speed: without waiting it were 0.5 rad behind.
TEST(TaskSequence, SlowsDownForAnArmThatLags) {
  Trial trial;
  trial.until([&] { return trial.arm.q[0] > 0.1; });
  trial.follows = false;
  double worst = 0.0;
  trial.until([&] {
    const Eigen::VectorXd lag = trial.sequence.set_point()->q - trial.arm.q;
    trial.arm.q += lag.cwiseMin(0.0025).cwiseMax(-0.0025);
    worst = std::max(worst, lag.cwiseAbs().maxCoeff());
    return trial.sequence.state() == State::done || trial.sequence.state() == State::failed;
  });
  EXPECT_EQ(trial.sequence.state(), State::done) << trial.sequence.reason();
  EXPECT_GT(worst, 0.25 * 0.25) << "less is no reason";
  EXPECT_LT(worst, 0.5 * 0.25) << "from here on it would wait";
}

TEST(TaskSequence, DoesNotWaitForEver) {
  Trial trial;
  trial.until([&] { return trial.arm.q[0] > 0.4; });
  trial.missing = "the decision";
  trial.until_rest();
  EXPECT_EQ(trial.sequence.reason(), "waited in vain for the decision");
  EXPECT_TRUE(trial.sequence.set_point()) << "the arm is well and held";
  trial.missing.clear();
  const Eigen::VectorXd rest = trial.arm.q;
  for (int i = 0; i < 1000; ++i) trial.step();
  EXPECT_EQ(trial.arm.q, rest) << "no motion after a stop";
}

TEST(TaskSequence, LeftOutStepsDoNotSlowTheMotion) {
  Trial one, three;
  three.periods = 3;
  three.follows = false;
  one.until_phase(Phase::reach);
  three.until_phase(Phase::reach);
  for (int i = 0; i < 30; ++i) one.step();
  for (int i = 0; i < 10; ++i) three.step();
  EXPECT_EQ(one.sequence.set_point()->q, three.sequence.set_point()->q);
}

TEST(TaskSequence, SaysHowTheMotionGoesOn) {
  Trial trial;
  trial.until([&] { return trial.arm.q[0] > 0.2; });
  const Eigen::MatrixXd ahead = trial.sequence.set_point()->ahead;
  ASSERT_EQ(ahead.cols(), 60);
  for (Eigen::Index k = 0; k < ahead.cols(); ++k) {
    trial.step();
    EXPECT_EQ(trial.sequence.set_point()->q, ahead.col(k));
  }
  trial.until([&] { return trial.sequence.phase() == Phase::grasp; });
  EXPECT_EQ(trial.sequence.set_point()->ahead.cols(), 0) << "at rest there is nothing ahead";
}

/// The bridge goes on by it while the machine lets the node wait, whatever the node finds then.
TEST(TaskSequence, DoesInStepsLeftOutWhatItSaid) {
  Trial trial, prompt;
  for (Trial* t : {&trial, &prompt}) t->until([&] { return t->arm.q[0] > 0.4; });
  prompt.step();
  prompt.step();
  trial.periods = 3;
  trial.missing = prompt.missing = "the scene";
  trial.step();
  prompt.step();
  EXPECT_EQ(trial.sequence.set_point()->q, prompt.sequence.set_point()->q);
}

TEST(TaskSequence, PlansAgainWhenTheObjectMovesDuringTheReach) {
  Trial trial;
  trial.until([&] { return trial.arm.q[0] > 0.4; });
  trial.table.object.y() += 0.02;
  trial.until([&] { return trial.requests.size() == 2; });
  ASSERT_EQ(trial.requests.size(), 2u);
  EXPECT_EQ(trial.requests[1].table.object.y(), 0.02);
  EXPECT_EQ(trial.requests[1].start, trial.arm.q) << "from where it came to rest";
  EXPECT_GT(trial.arm.q[0], 0.4);
  EXPECT_LT(trial.arm.q[0], 1.0);
}

TEST(TaskSequence, PlansAgainWhenAnObstacleComesIntoTheWayOfTheReach) {
  Trial trial;
  trial.until([&] { return trial.arm.q[0] > 0.4; });
  trial.table.balls.emplace_back();
  trial.until([&] { return trial.requests.size() == 2; });
  ASSERT_EQ(trial.requests.size(), 2u);
  EXPECT_EQ(trial.requests[1].table.balls.size(), 1u);
  EXPECT_LT(trial.arm.q[0], 1.0);
  trial.until_rest();
  EXPECT_EQ(trial.sequence.state(), State::done) << "the new plan knows of it";
}

TEST(TaskSequence, BrakesAndFailsWhenAnObstacleComesIntoTheWayOfTheTransport) {
  Trial trial;
  trial.until_phase(Phase::transport);
  trial.until([&] { return trial.arm.q[0] > 1.5; });
  trial.table.balls.emplace_back();
  trial.until_rest();
  EXPECT_EQ(trial.sequence.state(), State::failed);
  EXPECT_EQ(trial.sequence.reason(), "an obstacle moved into the way");
  EXPECT_LT(trial.arm.q[0], 1.9);
  EXPECT_EQ(trial.requests.size(), 1u);
}

TEST(TaskSequence, MillimetresOfTheObjectDoNotCount) {
  Trial trial;
  trial.until([&] { return trial.arm.q[0] > 0.4; });
  trial.table.object.y() += 0.004;
  trial.until_rest();
  EXPECT_EQ(trial.requests.size(), 1u);
  EXPECT_EQ(trial.sequence.state(), State::done);
}

TEST(TaskSequence, TimesOutInWords) {
  Trial no_scene;
  no_scene.has_table = false;
  no_scene.until_rest();
  EXPECT_EQ(no_scene.sequence.reason(), "waited in vain for the scene");

  Trial not_armed;
  not_armed.arm.operational = false;
  not_armed.until_rest();
  EXPECT_EQ(not_armed.sequence.reason(), "the arm is not operational");

  Trial no_hand;
  no_hand.hand.active = false;
  no_hand.until_rest();
  EXPECT_EQ(no_hand.sequence.reason(), "the hand is not active");

  Trial no_answer;
  no_answer.answer = nullptr;
  no_answer.until_rest();
  EXPECT_EQ(no_answer.sequence.reason(), "planning took too long");
}

TEST(TaskSequence, WaitsForTheHandToBeActivatedBeforeItMoves) {
  Trial trial;
  trial.hand.active = false;
  for (int i = 0; i < 100; ++i) trial.step();
  EXPECT_EQ(trial.sequence.state(), State::planning);
  EXPECT_EQ(trial.arm.q, both(0.0));
  trial.hand.active = true;
  trial.until_rest();
  EXPECT_EQ(trial.sequence.state(), State::done) << trial.sequence.reason();
}

TEST(TaskSequence, WaitsForTheArmToBeArmedAndPlansFromWhereItSagged) {
  Trial trial;
  trial.arm.operational = false;
  trial.follows = false;
  for (int i = 0; i < 50; ++i) trial.step();
  EXPECT_EQ(trial.sequence.state(), State::planning);
  EXPECT_TRUE(trial.sequence.plan_succeeded());
  trial.arm.q = both(-0.1);
  trial.arm.operational = true;
  trial.step();
  ASSERT_EQ(trial.requests.size(), 2u);
  EXPECT_EQ(trial.requests[1].start, both(-0.1));
}

TEST(TaskSequence, AbortedItBrakesOnItsPathAndHolds) {
  Trial trial;
  trial.until_phase(Phase::reach);
  for (int i = 0; i < 60; ++i) trial.step();  // 0.3 s: at full speed
  const double from = trial.arm.q[0];
  trial.abort = true;
  double fastest = 0.0, last = from;
  trial.until([&] {
    fastest = std::max(fastest, trial.arm.q[0] - last);
    last = trial.arm.q[0];
    return trial.sequence.at_rest();
  });
  EXPECT_EQ(trial.sequence.state(), State::failed);
  EXPECT_EQ(trial.sequence.reason(), "aborted");
  EXPECT_LE(fastest, 1.01 * 0.005) << "1 rad/s";
  EXPECT_NEAR(trial.arm.q[0] - from, 0.125, 0.02) << "v^2 / 2a, not to the end of the motion";
  EXPECT_EQ(trial.arm.q[0], trial.arm.q[1]) << "on the path";
  const Eigen::VectorXd held = trial.arm.q;
  for (int i = 0; i < 100; ++i) trial.step();
  EXPECT_EQ(trial.arm.q, held);
  ASSERT_TRUE(trial.sequence.set_point());
  EXPECT_EQ(trial.requests.size(), 1u) << "the same decision does not start again";
  trial.decision.id = 8;
  trial.step();
  EXPECT_EQ(trial.requests.size(), 2u);
}

TEST(TaskSequence, AbortedAtRestItEndsAtOnce) {
  Trial planning;
  planning.answer = nullptr;
  planning.step();
  planning.abort = true;
  planning.step();
  EXPECT_EQ(planning.sequence.reason(), "aborted");
  planning.sequence.set_plan(small_plan());
  planning.step();
  EXPECT_EQ(planning.sequence.state(), State::failed) << "a late plan starts nothing";

  Trial grasping;
  grasping.until_phase(Phase::grasp);
  grasping.abort = true;
  grasping.step();
  EXPECT_EQ(grasping.sequence.reason(), "aborted");
  grasping.abort = true;
  grasping.step();
  EXPECT_EQ(grasping.sequence.state(), State::failed);
}

TaskPlan small_move() {
  TaskPlan plan;
  plan.motions = {motion(Phase::reach, 0.0, 1.0), motion(Phase::reach, 1.0, 0.5)};
  plan.passed = {0, 1};
  return plan;
}

TEST(TaskSequence, AMoveLeavesTheHandAsItIs) {
  Trial trial;
  trial.decision.what = Move{{{both(1.0)}}, {{both(0.5)}}};
  trial.answer = [] { return small_move(); };
  trial.hand.closure = 0.7;
  trial.until_rest();
  EXPECT_EQ(trial.sequence.state(), State::done) << trial.sequence.reason();
  EXPECT_FALSE(trial.sequence.hand_order());
  EXPECT_EQ(trial.hand.closure, 0.7);
  EXPECT_EQ(trial.arm.q, both(0.5));
  EXPECT_EQ(trial.phases, std::vector{Phase::reach});
  EXPECT_EQ(trial.sequence.task(), nullptr);

  trial.decision.id = 8;
  trial.answer = [] { return TaskPlan{}; };
  for (int i = 0; i < 3; ++i) trial.step();
  EXPECT_EQ(trial.sequence.order_id(), 8u);
  EXPECT_EQ(trial.sequence.state(), State::done) << "it is there already";
}

TEST(TaskSequence, AMovePlannedAgainLeavesOutWhatItHasPassed) {
  Trial trial;
  trial.decision.what = Move{{{both(1.0)}}, {{both(0.5)}}};
  trial.answer = [] { return small_move(); };
  trial.until([&] { return trial.sequence.started_motion() == 1u; });
  trial.table.object.y() = 0.1;
  trial.answer = nullptr;
  trial.until([&] { return trial.requests.size() == 2; });
  ASSERT_EQ(trial.requests.size(), 2u);
  EXPECT_EQ(std::get<Move>(trial.requests[0].what).via.size(), 1u);
  EXPECT_EQ(std::get<Move>(trial.requests[1].what).via.size(), 0u);
}

TEST(TaskSequence, AMoveCarriesWhatTheHandHolds) {
  Trial trial;
  const std::vector<kin::Ball> held{{{0.0, 0.0, 0.01}, 0.03}};
  trial.answer = [&held] {
    TaskPlan plan = small_plan();
    for (std::size_t i : {2, 3}) plan.motions[i].obstacles.held = held;
    return plan;
  };
  trial.until_phase(Phase::transport);
  trial.abort = true;
  trial.until_rest();
  trial.decision = {Move{{}, {{both(0.0)}}}, 9};
  trial.answer = nullptr;
  trial.step();
  ASSERT_EQ(trial.requests.size(), 2u);
  ASSERT_EQ(trial.requests[1].held.size(), 1u);
  EXPECT_EQ(trial.requests[1].held[0].radius, 0.03);

  Trial unknown;  // it holds something, but since when?
  unknown.decision.what = Move{{}, {{both(0.5)}}};
  unknown.hand.object_detected = true;
  unknown.step();
  EXPECT_EQ(unknown.sequence.reason(), "the hand holds an object of unknown size");
}

}  // namespace
}  // namespace mimesis::planner
