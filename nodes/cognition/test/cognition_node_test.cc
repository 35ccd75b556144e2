#include "nodes/cognition/cognition_node.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "common/testing/loopback.h"
#include "common/testing/refusal.h"
#include "nodes/cognition/network_file.h"
#include "nodes/cognition/test/files.h"

namespace mimesis::cognition {
namespace {
using namespace std::chrono_literals;
using runtime::Time;

/// One node on a loopback bus, stepped at 100 Hz, with what vision and the planner would repeat.
class Rig {
 public:
  explicit Rig(const CognitionParams& params = {}) : node_(params, bus) {}

  /// Runs for `duration`; vision repeats `seen` at every step unless it is frozen.
  void run(Time duration) {
    for (const Time end = now_ + duration; now_ < end; now_ += 10ms) {
      if (vision_alive) bus.send("observation", seen, now_);
      if (task.state() != v1::TASK_STATE_UNSPECIFIED) bus.send("task", task, now_);
      node_.step(now_);
      while (auto d = bus.take<v1::Decision>("decision")) {
        ever_learned_ = ever_learned_ || d->learning();
        last_ = *d;
      }
    }
  }
  /// The teacher's table is empty again, then `demonstration`.
  void show(const v1::Observation& demonstration) {
    seen = {};
    run(100ms);
    seen = demonstration;
    run(1500ms);
  }
  void planner_says(v1::TaskState state, bool plan_succeeded) {
    task.set_state(state);
    task.set_plan_succeeded(plan_succeeded);
    task.set_grip(last_.grip());
    task.set_transport(last_.transport());
    task.set_goal(last_.goal());
  }
  const v1::Decision& decision() const { return last_; }
  bool ever_learned() const { return ever_learned_; }
  Time now() const { return now_; }
  void step() { node_.step(now_); }

  testing::Loopback bus;
  v1::Observation seen;
  v1::TaskStatus task;
  bool vision_alive = true;

 private:
  CognitionNode node_;
  v1::Decision last_;
  bool ever_learned_ = false;
  Time now_ = 1s;
};

v1::Observation observation(v1::Grip grip, v1::Transport transport, v1::Goal goal,
                            bool complete = true, double confidence = 1.0) {
  v1::Observation o;
  o.set_grip(grip);
  o.set_transport(transport);
  o.set_goal(goal);
  o.set_complete(complete);
  o.set_grip_confidence(confidence);
  o.set_transport_confidence(confidence);
  o.set_goal_confidence(confidence);
  o.set_color_confidence(confidence);
  return o;
}

const v1::Observation kPreferred =
    observation(v1::GRIP_PRECISION, v1::TRANSPORT_ABOVE, v1::GOAL_HIGH);
const v1::Observation kOther = observation(v1::GRIP_FULL, v1::TRANSPORT_BELOW, v1::GOAL_LOW);

std::string text(const v1::Decision& d) {
  return v1::Grip_Name(d.grip()) + " " + v1::Transport_Name(d.transport()) + " " +
         v1::Goal_Name(d.goal());
}

v1::Observation only_color(v1::ObjectColor color) {
  v1::Observation o;
  o.set_color(color);
  o.set_color_confidence(1.0);
  return o;
}
v1::Observation grasp_only(v1::Grip grip) {
  return observation(grip, v1::TRANSPORT_UNSPECIFIED, v1::GOAL_UNSPECIFIED, false);
}

TEST(CognitionNode, AnIdleObjectStartsNeitherPatienceNorADecision) {
  Rig rig({.imitator = {.practice = {"precision,above,high,light", "full,below,low,dark"}}});
  rig.seen = only_color(v1::OBJECT_COLOR_LIGHT);  // stands there; the teacher takes his time
  rig.run(12s);
  EXPECT_EQ(rig.decision().goal(), v1::GOAL_UNSPECIFIED);
  EXPECT_FALSE(rig.decision().settled());
  rig.seen = kOther;
  rig.seen.set_color(v1::OBJECT_COLOR_DARK);
  rig.run(1500ms);
  EXPECT_TRUE(rig.decision().settled());
  EXPECT_EQ(text(rig.decision()), "GRIP_FULL TRANSPORT_BELOW GOAL_LOW");
}

TEST(CognitionNode,
     AfterAMereGraspTheNextDemonstrationCounts) {  // the object's colour stays in view
  Rig rig({.imitator = {.patience_s = 0.5}});
  rig.seen = grasp_only(v1::GRIP_FULL);
  rig.seen.set_color(v1::OBJECT_COLOR_LIGHT);
  rig.run(2s);
  ASSERT_EQ(text(rig.decision()), "GRIP_FULL TRANSPORT_BELOW GOAL_LOW");
  rig.seen = only_color(v1::OBJECT_COLOR_LIGHT);  // vision forgets the grasp when the hand is back
  rig.run(100ms);
  EXPECT_FALSE(rig.decision().settled());
  rig.seen = kPreferred;
  rig.seen.set_color(v1::OBJECT_COLOR_LIGHT);
  rig.run(1500ms);
  EXPECT_EQ(text(rig.decision()), "GRIP_PRECISION TRANSPORT_ABOVE GOAL_HIGH");
}

TEST(CognitionNode, ADecisionThatNeverFallsEndsWithAReason) {
  Rig rig({.imitator = {.practice = {}, .patience_s = 0.5}});
  rig.seen = grasp_only(v1::GRIP_FULL);
  rig.run(3s);
  EXPECT_EQ(rig.decision().reason(), "");
  rig.run(1s);
  EXPECT_FALSE(rig.decision().settled());
  EXPECT_EQ(rig.decision().reason(), "PFC has no peak");
  rig.seen = kOther;  // the teacher goes on after all
  rig.run(1500ms);
  EXPECT_TRUE(rig.decision().settled());
  EXPECT_EQ(rig.decision().reason(), "");
}

TEST(CognitionNode, WithoutAPlanOtherMeansAreTriedThenTheMeansDecide) {
  Rig rig;
  rig.show(observation(v1::GRIP_FULL, v1::TRANSPORT_BELOW, v1::GOAL_HIGH));
  ASSERT_EQ(text(rig.decision()), "GRIP_PRECISION TRANSPORT_ABOVE GOAL_HIGH");
  rig.planner_says(v1::TASK_STATE_FAILED, false);
  rig.run(1500ms);
  EXPECT_EQ(text(rig.decision()), "GRIP_FULL TRANSPORT_BELOW GOAL_HIGH");  // the means shown
  rig.planner_says(v1::TASK_STATE_FAILED, false);
  rig.run(1500ms);
  EXPECT_EQ(text(rig.decision()), "GRIP_FULL TRANSPORT_BELOW GOAL_LOW");  // the goal of these means
  EXPECT_FALSE(rig.ever_learned());
  rig.planner_says(v1::TASK_STATE_FAILED, false);
  rig.run(100ms);
  EXPECT_FALSE(rig.decision().settled());
  EXPECT_EQ(rig.decision().reason(), "no plan, and no alternative is left");
  rig.task.Clear();
  rig.show(kPreferred);  // doubts end with the demonstration
  EXPECT_EQ(text(rig.decision()), "GRIP_PRECISION TRANSPORT_ABOVE GOAL_HIGH");
}

/// The planner's answer to the newest proposal, which is returned.
std::string answer(Rig& rig, bool feasible) {
  const auto proposal = rig.bus.take_last<v1::Decision>("proposal");
  if (!proposal) return "none";
  v1::TaskStatus status;
  status.set_state(feasible ? v1::TASK_STATE_EXECUTING : v1::TASK_STATE_FAILED);
  status.set_plan_succeeded(feasible);
  status.set_grip(proposal->grip());
  status.set_transport(proposal->transport());
  status.set_goal(proposal->goal());
  rig.bus.send("test_plan", status, rig.now());
  rig.run(50ms);
  return text(*proposal);
}

TEST(CognitionNode, ATestPlanBeforeTheDecisionShiftsIt) {  // fig. 2.22 over messages
  const v1::Observation shown = observation(v1::GRIP_FULL, v1::TRANSPORT_ABOVE, v1::GOAL_HIGH);
  for (const int feasible : {0, 1, 2}) {  // the first that is; 2: none
    Rig rig({.imitator = {.rehearse = true}});
    rig.show(shown);
    EXPECT_FALSE(rig.decision().settled()) << "decided before the test plan";
    EXPECT_EQ(answer(rig, feasible == 0), "GRIP_FULL TRANSPORT_ABOVE GOAL_HIGH");
    if (feasible > 0) {
      EXPECT_EQ(answer(rig, feasible == 1), "GRIP_FULL TRANSPORT_BELOW GOAL_HIGH");
    }
    rig.run(2500ms);
    EXPECT_EQ(answer(rig, true), "none") << "asked again";
    const std::string expected[] = {"GRIP_FULL TRANSPORT_ABOVE GOAL_HIGH",
                                    "GRIP_FULL TRANSPORT_BELOW GOAL_HIGH",
                                    "GRIP_PRECISION TRANSPORT_ABOVE GOAL_HIGH"};
    EXPECT_TRUE(rig.decision().settled());
    EXPECT_EQ(text(rig.decision()), expected[feasible]);
    const auto why = rig.bus.take_last<v1::Explanation>("explanation");
    EXPECT_GT(why->deciding_s(), 1.0) << "the time of the questions counts";
  }
}

TEST(CognitionNode, WithoutAnAnswerTheTestPlanIsForgotten) {
  Rig rig({.imitator = {.rehearse = true, .rehearsal_s = 2.0}});
  rig.show(observation(v1::GRIP_FULL, v1::TRANSPORT_ABOVE, v1::GOAL_HIGH));
  v1::TaskStatus other;  // of another question
  other.set_state(v1::TASK_STATE_EXECUTING);
  other.set_plan_succeeded(true);
  other.set_grip(v1::GRIP_PRECISION);
  rig.bus.send("test_plan", other, rig.now());
  rig.run(400ms);
  EXPECT_EQ(rig.decision().grip(), v1::GRIP_UNSPECIFIED);
  rig.run(2s);
  EXPECT_TRUE(rig.decision().settled());
}

TEST(CognitionNode, AnIndecisionThatLastsEndsTheRun) {
  Rig rig({.imitator = {.practice = {}, .patience_s = 0.5}});
  rig.seen = grasp_only(v1::GRIP_FULL);
  rig.run(3600ms);
  EXPECT_FALSE(rig.bus.take<v1::TrialOutcome>("outcome").has_value());
  rig.run(1s);
  const auto outcome = rig.bus.take<v1::TrialOutcome>("outcome");
  ASSERT_TRUE(outcome.has_value());
  EXPECT_FALSE(outcome->success());
  EXPECT_EQ(outcome->reason(), "no decision: PFC has no peak");
  rig.run(2s);
  EXPECT_FALSE(rig.bus.take<v1::TrialOutcome>("outcome").has_value()) << "told twice";
}

TEST(CognitionNode, AFailureOnTheWayTriesNothingElse) {
  Rig rig;
  rig.show(kPreferred);
  rig.planner_says(v1::TASK_STATE_EXECUTING, true);
  rig.run(100ms);
  rig.planner_says(v1::TASK_STATE_FAILED, false);  // the arm or the hand, not the plan
  rig.run(1s);
  EXPECT_TRUE(rig.decision().settled());
  EXPECT_EQ(text(rig.decision()), "GRIP_PRECISION TRANSPORT_ABOVE GOAL_HIGH");
}

TEST(CognitionNode, CopiesWhatWasShown) {
  Rig rig;
  rig.run(500ms);
  EXPECT_FALSE(rig.decision().settled());
  EXPECT_EQ(rig.decision().decided_ns(), 0U);
  rig.show(kPreferred);
  EXPECT_TRUE(rig.decision().settled());
  EXPECT_EQ(text(rig.decision()), "GRIP_PRECISION TRANSPORT_ABOVE GOAL_HIGH");
  const std::uint64_t decided_ns = rig.decision().decided_ns();
  EXPECT_GT(decided_ns, static_cast<std::uint64_t>(Time(1s).count()));
  EXPECT_GT(rig.decision().header().stamp_ns(), decided_ns);
  rig.show(kOther);
  EXPECT_EQ(text(rig.decision()), "GRIP_FULL TRANSPORT_BELOW GOAL_LOW");
  EXPECT_GT(rig.decision().decided_ns(), decided_ns);
}

TEST(CognitionNode,
     WaitsForTheEndOfTheDemonstration) {  // the grip alone would be inferred to be FG-BT-low
  Rig rig;
  rig.seen = observation(v1::GRIP_FULL, v1::TRANSPORT_UNSPECIFIED, v1::GOAL_UNSPECIFIED, false);
  rig.run(2s);
  rig.seen.set_transport(v1::TRANSPORT_ABOVE);
  rig.run(2s);
  EXPECT_EQ(rig.decision().grip(), v1::GRIP_UNSPECIFIED);
  rig.seen = observation(v1::GRIP_FULL, v1::TRANSPORT_ABOVE, v1::GOAL_HIGH);
  rig.run(1500ms);
  EXPECT_EQ(text(rig.decision()),
            "GRIP_PRECISION TRANSPORT_ABOVE GOAL_HIGH");  // goal over means, fig. 2.21
}

TEST(CognitionNode, SettlesOnWhatTheFieldsHoldWithoutInput) {
  const NetworkFile slow("window_s: 0.6", "window_s: 1.2");
  Rig rig({.network = slow.path});
  rig.seen = kPreferred;
  rig.run(1100ms);  // stable long ago, but under input
  EXPECT_EQ(text(rig.decision()), "GRIP_PRECISION TRANSPORT_ABOVE GOAL_HIGH");
  EXPECT_FALSE(rig.decision().settled());
  rig.run(900ms);
  EXPECT_TRUE(rig.decision().settled());
}

TEST(CognitionNode, InfersWhatStayedHidden) {  // fig. 2.20: never complete, nothing new
  Rig rig({.imitator = {.patience_s = 1.0}});
  rig.seen = observation(v1::GRIP_FULL, v1::TRANSPORT_UNSPECIFIED, v1::GOAL_UNSPECIFIED, false);
  rig.run(900ms);
  EXPECT_FALSE(rig.decision().settled());
  rig.run(1500ms);
  EXPECT_TRUE(rig.decision().settled());
  EXPECT_EQ(text(rig.decision()), "GRIP_FULL TRANSPORT_BELOW GOAL_LOW");
}

TEST(CognitionNode, UntrainedItInfersNothing) {
  Rig rig({.imitator = {.practice = {}, .patience_s = 0.5}});
  rig.seen = observation(v1::GRIP_FULL, v1::TRANSPORT_UNSPECIFIED, v1::GOAL_UNSPECIFIED, false);
  rig.run(4s);
  EXPECT_FALSE(rig.decision().settled());
  EXPECT_EQ(rig.decision().goal(), v1::GOAL_UNSPECIFIED);
}

TEST(CognitionNode, TheDecisionStays) {
  Rig rig;
  rig.show(kPreferred);
  const v1::Decision decided = rig.decision();
  rig.seen = kOther;  // without an empty table before it this is no new demonstration
  rig.run(2s);
  rig.vision_alive = false;
  rig.run(2s);
  EXPECT_EQ(text(rig.decision()), text(decided));
  EXPECT_EQ(rig.decision().decided_ns(), decided.decided_ns());
  EXPECT_TRUE(rig.decision().settled());
}

TEST(CognitionNode, IgnoresStaleObservations) {
  Rig rig({.stale_s = 0.3, .imitator = {.patience_s = 1.0}});
  rig.seen = observation(v1::GRIP_FULL, v1::TRANSPORT_UNSPECIFIED, v1::GOAL_UNSPECIFIED, false);
  rig.run(500ms);
  rig.vision_alive = false;  // died in the middle of the demonstration
  rig.run(5s);
  EXPECT_EQ(rig.decision().grip(), v1::GRIP_UNSPECIFIED);
  rig.vision_alive = true;
  rig.seen = kPreferred;
  rig.run(1500ms);
  EXPECT_TRUE(rig.decision().settled());
}

TEST(CognitionNode, SaysThatTheTeacherIsOutOfSight) {
  Rig rig;
  rig.vision_alive = false;
  rig.run(500ms);
  EXPECT_FALSE(rig.decision().sight_lost()) << "never seen is not lost";
  rig.vision_alive = true;
  rig.run(100ms);
  rig.vision_alive = false;
  rig.run(70ms);
  EXPECT_FALSE(rig.decision().sight_lost()) << "a lost image";
  rig.run(40ms);
  EXPECT_TRUE(rig.decision().sight_lost());
  rig.vision_alive = true;
  rig.run(20ms);
  EXPECT_FALSE(rig.decision().sight_lost());
}

TEST(CognitionNode, IgnoresWrongValues) {
  Rig rig;
  v1::Observation wrong = kPreferred;
  wrong.set_grip(static_cast<v1::Grip>(7));
  rig.show(wrong);
  EXPECT_EQ(rig.decision().grip(), v1::GRIP_UNSPECIFIED);
  wrong = kPreferred;
  wrong.set_goal_confidence(1.5);
  rig.show(wrong);
  EXPECT_EQ(rig.decision().goal(), v1::GOAL_UNSPECIFIED);
  wrong.set_goal_confidence(NAN);
  rig.show(wrong);
  EXPECT_EQ(rig.decision().goal(), v1::GOAL_UNSPECIFIED);
  EXPECT_GT(rig.bus.counters("observation").rejected, 0U);
  rig.bus.send_raw("observation", "not a message", rig.now());
  rig.show(kPreferred);
  EXPECT_TRUE(rig.decision().settled());
}

TEST(CognitionNode, ASymbolThatContradictsItselfDoesNotCount) {
  Rig rig({.imitator = {.patience_s = 0.5}});
  const auto flicker = [&](Time duration) {
    for (const Time end = rig.now() + duration; rig.now() < end; rig.run(20ms)) {
      const bool full = rig.seen.grip() == v1::GRIP_FULL;
      rig.seen = observation(full ? v1::GRIP_PRECISION : v1::GRIP_FULL, v1::TRANSPORT_BELOW,
                             v1::GOAL_UNSPECIFIED, false);
    }
  };
  flicker(100ms);
  EXPECT_EQ(rig.decision().grip(), v1::GRIP_UNSPECIFIED);
  flicker(2s);  // the rest decides, as if the grip had been hidden
  EXPECT_EQ(text(rig.decision()), "GRIP_FULL TRANSPORT_BELOW GOAL_LOW");
  rig.show(kPreferred);  // doubts end with the demonstration
  EXPECT_EQ(text(rig.decision()), "GRIP_PRECISION TRANSPORT_ABOVE GOAL_HIGH");
  rig.seen = {};
  rig.run(100ms);
  rig.seen = grasp_only(v1::GRIP_PRECISION);  // a single correction is none
  rig.run(100ms);
  rig.seen = kOther;
  rig.run(1500ms);
  EXPECT_EQ(text(rig.decision()), "GRIP_FULL TRANSPORT_BELOW GOAL_LOW");
}

TEST(CognitionNode, MeansThatContradictTheGoalGiveWay) {  // and without a plan for it they decide
  Rig rig;
  rig.show(observation(v1::GRIP_FULL, v1::TRANSPORT_BELOW, v1::GOAL_HIGH));
  EXPECT_EQ(text(rig.decision()), "GRIP_PRECISION TRANSPORT_ABOVE GOAL_HIGH");
  rig.show(observation(v1::GRIP_PRECISION, v1::TRANSPORT_ABOVE, v1::GOAL_LOW));
  EXPECT_EQ(text(rig.decision()), "GRIP_FULL TRANSPORT_BELOW GOAL_LOW");
}

// Transient fields beside the seven [M18 eq. 2.6 to 2.8]: what was seen in order comes back in
// order.
TEST(CognitionNode, ASequenceThatWasSeenIsExpectedAgain) {
  const NetworkFile file(
      "links:                           #",
      R"(  - {name: grasped, sites: [PG, FG], neurons: 64, resting_level: -2, threshold1: 0, excitation: 1.3, width: 3,
     inhibition: 0, decay: 0.6}
  - {name: placed, sites: [high, low], neurons: 64, resting_level: -2, threshold1: 0, excitation: 1.3, width: 3,
     inhibition: 0, decay: 0.6}
links:
  - {from: grasped, to: placed, gain: 0.6, learns: always}
  - {from: placed, to: grasped, gain: 0.6, learns: always}
#)");
  file.replace("inputs:\n",
               "inputs:\n  - {name: vision, into: grasped, gain: 4}\n"
               "  - {name: vision, into: placed, gain: 4}\n");
  const PassingFile links("links.json");
  CognitionParams params{.fields_hz = 100.0,
                         .network = file.path,
                         .save_links = links.path,
                         .imitator = {.order_s = 0.15, .patience_s = 0.5}};
  Rig robot(params);
  // To the grasp alone: most of `placed` at low, and at high.
  const auto answer = [](Rig& rig) {
    rig.seen = {};
    rig.run(100ms);
    rig.seen = grasp_only(v1::GRIP_FULL);
    std::pair<float, float> most{-100.0F, -100.0F};
    for (const Time end = rig.now() + 1500ms; rig.now() < end;) {
      rig.run(10ms);
      const auto all = rig.bus.take_last<v1::FieldActivity>("fields");
      most.first = std::max(most.first, all->fields(8).u(48));
      most.second = std::max(most.second, all->fields(8).u(16));
    }
    return most;
  };
  EXPECT_LT(answer(robot).first, 0.0F) << "nothing was learned yet";
  for (int i = 0; i < 10; ++i) {
    robot.seen = {};
    robot.run(100ms);
    robot.seen = grasp_only(v1::GRIP_FULL);
    robot.run(100ms);
    robot.seen = kOther;
    robot.run(1500ms);
  }
  const auto learned = answer(robot);
  EXPECT_GT(learned.first, 0.0F);
  EXPECT_LT(learned.second, 0.0F);
  params.links = links.path;  // no plan was rewarded, but the sequence was kept
  Rig heir(params);
  EXPECT_EQ(answer(heir), learned);
}

TEST(CognitionNode, AMessageTellsWhatTheTaskHolds) {
  Rig rig;
  const auto onset_s = [&] {  // of the field of goals, for a goal without means
    rig.show(observation(v1::GRIP_UNSPECIFIED, v1::TRANSPORT_UNSPECIFIED, v1::GOAL_HIGH));
    const auto why = rig.bus.take_last<v1::Explanation>("explanation");
    for (const v1::FieldReason& f : why->fields()) {
      if (f.field() == "PFC") return f.onset_s();
    }
    return -1.0;
  };
  const auto tell = [&](const std::vector<std::pair<int, double>>& goals) {
    v1::TaskGoals message;
    for (const auto& [goal, probability] : goals) {
      v1::TaskGoal& g = *message.add_goals();
      g.set_goal(static_cast<v1::Goal>(goal));
      if (probability >= 0.0) g.set_probability(probability);
    }
    rig.bus.send("goals", message, rig.now());
  };
  const double even = onset_s();
  EXPECT_GT(even, 0.0);
  const std::uint64_t decided_ns = rig.decision().decided_ns();
  tell({{v1::GOAL_HIGH, -1.0}});
  rig.run(500ms);
  EXPECT_EQ(rig.decision().decided_ns(), decided_ns) << "a decision stays";
  const double certain = onset_s();
  EXPECT_LT(certain, even);
  tell({{v1::GOAL_LOW, -1.0}, {v1::GOAL_HIGH, 0.2}});
  const double unlikely = onset_s();
  EXPECT_GT(unlikely, even);
  tell({{v1::GOAL_HIGH, 0.5}, {v1::GOAL_LOW, 0.5}});
  EXPECT_EQ(onset_s(), even);
  tell({{v1::GOAL_HIGH, 1.5}});
  tell({{v1::GOAL_HIGH, -1.0}, {v1::GOAL_HIGH, -1.0}});
  tell({{v1::GOAL_HIGH, 0.7}, {v1::GOAL_LOW, 0.4}});
  tell({{7, -1.0}});
  tell({{v1::GOAL_UNSPECIFIED, -1.0}});
  EXPECT_EQ(onset_s(), even) << "what cannot be is not used";
}

TEST(CognitionNode, DoubtfulSymbolsDecideNothing) {
  Rig rig;
  rig.show(observation(v1::GRIP_PRECISION, v1::TRANSPORT_ABOVE, v1::GOAL_HIGH, true, 0.2));
  EXPECT_FALSE(rig.decision().settled());
  rig.show(observation(v1::GRIP_PRECISION, v1::TRANSPORT_ABOVE, v1::GOAL_HIGH, true, 0.85));
  EXPECT_TRUE(rig.decision().settled());
}

TEST(CognitionNode, LearnsOnlyWhileThePlanSucceeds) {
  Rig rig({.imitator = {.practice = {}, .patience_s = 0.5}});
  rig.show(kOther);
  ASSERT_TRUE(rig.decision().settled());
  rig.planner_says(v1::TASK_STATE_PLANNING, false);
  rig.run(1s);
  EXPECT_FALSE(rig.ever_learned());
  rig.planner_says(v1::TASK_STATE_EXECUTING, true);
  rig.run(1s);
  EXPECT_TRUE(rig.decision().learning());
  EXPECT_FALSE(rig.decision().learned());
  rig.run(1100ms);
  EXPECT_FALSE(rig.decision().learning());  // the window is over
  EXPECT_TRUE(rig.decision().learned());
  EXPECT_EQ(text(rig.decision()), "GRIP_FULL TRANSPORT_BELOW GOAL_LOW");

  rig.task.Clear();  // the learned links infer the goal from the grip
  rig.show(observation(v1::GRIP_FULL, v1::TRANSPORT_UNSPECIFIED, v1::GOAL_UNSPECIFIED, false));
  rig.run(1s);
  EXPECT_EQ(text(rig.decision()), "GRIP_FULL TRANSPORT_BELOW GOAL_LOW");
  EXPECT_FALSE(rig.decision().learned());  // not yet for this decision
}

TEST(CognitionNode, LinksOutliveTheProcess) {
  const PassingFile file("links.json");
  {
    Rig teacher({.save_links = file.path, .imitator = {.practice = {}}});
    teacher.show(kOther);
    teacher.planner_says(v1::TASK_STATE_EXECUTING, true);
    teacher.run(1s);
    EXPECT_EQ(file.read(), "") << "saved before the window was over";
    teacher.run(1500ms);
  }
  const std::string learned = file.read();
  ASSERT_NE(learned, "");
  Rig heir({.links = file.path, .imitator = {.patience_s = 0.5}});
  heir.show(grasp_only(v1::GRIP_FULL));
  heir.run(1s);
  EXPECT_EQ(text(heir.decision()), "GRIP_FULL TRANSPORT_BELOW GOAL_LOW");
  heir.show(grasp_only(v1::GRIP_PRECISION));  // it has not practised the other sequence
  heir.run(3s);
  EXPECT_EQ(heir.decision().goal(), v1::GOAL_UNSPECIFIED);

  FieldNetwork<float> network(load_network());
  load_links(file.path, network);
  EXPECT_EQ(links_text(network) + "\n", learned) << "a weight changed on the way";
}

// Bundles of motions [M18 2.3.1]: over messages, and kept with the links.
TEST(CognitionNode, ADecisionPreSelectsTheMotionsThatLedToSuccess) {
  const PassingFile file("links.json");
  CognitionParams params{.network = "bundle_fields.yaml", .save_links = file.path};
  Rig rig(params);
  const auto planned = [&](const v1::Observation& seen, double joint_rad, bool success) {
    rig.show(seen);
    rig.planner_says(success ? v1::TASK_STATE_EXECUTING : v1::TASK_STATE_FAILED, success);
    for (const double other_rad : {0.0, 0.1, 0.2}) {
      v1::Posture& q = *rig.task.add_carried();
      q.add_position_rad(joint_rad);
      q.add_position_rad(other_rad);
    }
    rig.run(2500ms);
    rig.task.Clear();
  };
  const auto first_joint = [](Rig& robot, const v1::Observation& seen) {
    robot.show(seen);
    const v1::Decision& d = robot.decision();
    EXPECT_TRUE(d.settled());
    return d.preselected_size() != 3 ? std::nan("") : d.preselected(2).position_rad(0);
  };
  planned(kPreferred, 1.0, false);
  EXPECT_TRUE(std::isnan(first_joint(rig, kPreferred))) << "learned without success";
  planned(kPreferred, 1.0, true);
  planned(kOther, -1.0, true);
  planned(kPreferred, 1.2, true);  // near the first: the same bundle, whose mean is told
  EXPECT_NEAR(first_joint(rig, kPreferred), 1.1, 1e-12);
  EXPECT_NEAR(first_joint(rig, kOther), -1.0, 1e-12);

  params.links = file.path;
  Rig heir(params);
  EXPECT_NEAR(first_joint(heir, kPreferred), 1.1, 1e-12);
  EXPECT_NEAR(first_joint(heir, kOther), -1.0, 1e-12);
  file.replace("\"bundles\"", "\"bundle\"");
  EXPECT_THROW(Rig{params}, ConfigError);
}

TEST(CognitionNode, RefusesLinksThatDoNotFit) {
  const auto refused = [](const std::string& from, const std::string& to, const char* why,
                          const CognitionParams& given = {}) {
    const PassingFile file("links.json");
    FieldNetwork<float> network(load_network());
    network.install("PF->PFC", kFgBt, 1);
    ASSERT_EQ(save_links(file.path, links_text(network)), "");
    if (!from.empty()) file.replace(from, to);
    testing::Loopback bus;
    CognitionParams params = given;
    params.links = file.path;
    const std::string words = testing::refusal([&] { const CognitionNode node(params, bus); });
    EXPECT_NE(words.find(why), std::string::npos) << words;
    EXPECT_NE(words.find(file.path), std::string::npos) << words;
  };
  refused("\"version\":2", "\"version\":1", "is of version 1, expected 2");
  refused("mimesis-links", "other", "expected \"format\"");
  const NetworkFile wide("field: {neurons: 128", "field: {neurons: 192");
  refused("", "", "was learned with PF.neurons = 128, here it is 192", {.network = wide.path});
  refused("\"inhibition\":1.0", "\"inhibition\":1.5", "PF.inhibition = 1.5");
  refused("PF->PFC", "PF->PFX", "PF->PFC");
  refused("\"PF->PFC\":[[", "\"PF->PFC\":[[2", "reaches beyond 128 x 128 neurons");
  refused("{\"format", "[\"format", "no file of links");
  testing::Loopback bus;
  EXPECT_THROW(CognitionNode({.links = "/nowhere/links.json"}, bus), ConfigError);
}

TEST(CognitionNode, DoesNotLearnFromOtherStatus) {
  Rig rig({.task_stale_s = 0.5});
  rig.show(kPreferred);
  rig.planner_says(v1::TASK_STATE_DONE, true);  // success of an earlier decision for the same means
  rig.run(1s);
  rig.planner_says(v1::TASK_STATE_EXECUTING, true);
  rig.task.set_grip(v1::GRIP_FULL);  // success of other means
  rig.run(1s);
  EXPECT_FALSE(rig.ever_learned());
  EXPECT_FALSE(rig.decision().learned());
  rig.planner_says(v1::TASK_STATE_EXECUTING, true);
  rig.run(200ms);
  EXPECT_TRUE(rig.ever_learned());
  rig.task.Clear();  // the planner died: its last word is soon too old
  rig.run(1s);
  EXPECT_FALSE(rig.decision().learning());
  EXPECT_FALSE(rig.decision().learned());
}

TEST(CognitionNode, SuccessBeforeTheDecisionRewardsNothing) {
  Rig rig({.task_stale_s = 60.0});
  rig.show(kPreferred);
  rig.planner_says(v1::TASK_STATE_EXECUTING, true);
  rig.seen = {};
  rig.run(100ms);  // the planner still executes the decision for the last demonstration
  rig.task.Clear();
  ASSERT_FALSE(rig.ever_learned());
  rig.seen = kPreferred;
  rig.run(3s);
  EXPECT_TRUE(rig.decision().settled());
  EXPECT_FALSE(rig.ever_learned());
}

TEST(CognitionNode, PublishesFieldsAtTheirRate) {
  Rig rig;
  rig.run(1s);
  int count = 0;
  while (const auto f = rig.bus.take<v1::FieldActivity>("fields")) {
    ASSERT_EQ(f->fields_size(), 7);
    EXPECT_EQ(f->fields(0).name(), "STSg");
    EXPECT_EQ(f->fields(6).name(), "COL");
    ASSERT_EQ(f->fields(2).u_size(), 128);
    EXPECT_LT(f->fields(2).u(16), 0.0F);
    ++count;
  }
  EXPECT_EQ(count, 25);
  rig.show(kPreferred);
  const auto last = rig.bus.take_last<v1::FieldActivity>("fields");
  ASSERT_TRUE(last.has_value());
  EXPECT_GT(last->fields(2).u(16), 5.0F);  // PG-AT
}

TEST(CognitionNode, RefusesWhatCannotWork) {
  testing::Loopback bus;
  EXPECT_THROW(CognitionNode({.rate_hz = 77.0}, bus), ConfigError);
  EXPECT_THROW(CognitionNode({.imitator = {.practice = {"precise,above,high"}}}, bus), ConfigError);
}

}  // namespace
}  // namespace mimesis::cognition
