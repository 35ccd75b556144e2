#include "nodes/cognition/imitator.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "common/error.h"
#include "common/testing/no_malloc.h"
#include "nodes/cognition/network_file.h"
#include "nodes/cognition/trial.h"

namespace mimesis::cognition {
namespace {

constexpr double kPeriod_s = 0.01;

/// Shows the steps one after the other, each for 0.1 s, the last as a complete action.
Decision shown(Imitator& robot, const std::vector<Demonstration>& steps) {
  robot.observe({}, false, kPeriod_s);
  for (const Demonstration& d : steps) {
    for (int i = 0; i < 10; ++i) robot.observe(d, false, kPeriod_s);
  }
  robot.observe(steps.back(), true, kPeriod_s);
  while (robot.stage() == Imitator::Stage::deciding) {
    const testing::NoMalloc guard;
    robot.advance(kPeriod_s, false);
  }
  return robot.decision();
}

std::vector<Demonstration> means_first(Grip g, Transport t, Goal goal) {
  return {{.grip = g}, {.grip = g, .transport = t}, {.grip = g, .transport = t, .goal = goal}};
}
std::vector<Demonstration> goal_first(Grip g, Transport t, Goal goal) {
  return {
      {.goal = goal}, {.transport = t, .goal = goal}, {.grip = g, .transport = t, .goal = goal}};
}

// [M18 fig. 2.21]: who is decided first drives the other. Apart by more than the goal's lead, what
// was seen first wins; by as little as in launch/imitation.yaml, the goal does.
TEST(Imitator, TheOrderInWhichSymbolsAreSeenReachesTheFields) {
  for (const auto& [order_s, means_win] : {std::pair{0.0, false}, {0.005, false}, {0.3, true}}) {
    Imitator robot({.order_s = order_s}, load_network());
    const Decision goal = shown(robot, goal_first(Grip::full, Transport::below, Goal::high));
    EXPECT_EQ(goal.grip, Grip::precision) << order_s;
    EXPECT_EQ(goal.transport, Transport::above) << order_s;
    EXPECT_EQ(goal.goal, Goal::high) << order_s;
    const Decision means = shown(robot, means_first(Grip::full, Transport::below, Goal::high));
    EXPECT_EQ(means.grip == Grip::full, means_win) << order_s;
    EXPECT_EQ(means.transport == Transport::below, means_win) << order_s;
  }
}

TEST(Imitator, ASmallLagChangesNoneOfTheEightDecisions) {
  Imitator at_once({}, load_network());
  Imitator in_turn({.order_s = 0.005}, load_network());
  for (const Grip g : {Grip::precision, Grip::full}) {
    for (const Transport t : {Transport::above, Transport::below}) {
      for (const Goal goal : {Goal::high, Goal::low}) {
        const auto steps = means_first(g, t, goal);
        EXPECT_EQ(shown(at_once, {steps.back()}), shown(in_turn, steps));
      }
    }
  }
}

/// Time until PFC is active, for a goal of confidence 0.8 without means [s].
double goal_onset_s(const std::vector<std::string>& goals, Goal goal, double confidence) {
  Imitator robot({.goals = goals}, load_network());
  shown(robot, {{.goal = goal, .goal_confidence = confidence}});
  return robot.reasons().fields()[index(Layer::pfc)].onset_s;
}

TEST(Imitator, ExpectedGoalsAreDecidedFasterAndFromLess) {  // number, identity, probability
  const double certain = goal_onset_s({"high"}, Goal::high, 1.0),
               likely = goal_onset_s({"high=0.8", "low"}, Goal::high, 1.0),
               even = goal_onset_s({"high", "low"}, Goal::high, 1.0),
               unlikely = goal_onset_s({"high=0.2", "low"}, Goal::high, 1.0),
               other = goal_onset_s({"low"}, Goal::high, 1.0);
  EXPECT_GT(certain, 0.0);
  EXPECT_LT(certain, likely);
  EXPECT_LT(likely, even);
  EXPECT_LT(even, unlikely);
  EXPECT_LT(unlikely, other);
  // A glimpse is enough for the goal that the task makes likely, not for the other.
  EXPECT_GT(goal_onset_s({"high=0.9", "low"}, Goal::high, 0.2), 0.0);
  EXPECT_LT(goal_onset_s({"high=0.1", "low"}, Goal::high, 0.2), 0.0);
}

TEST(Bundles, AreSortedByTheMeanDistanceOfPostures) {
  Bundles bundles(2, 1.0);
  const auto motion = [](double first, double second) {
    return Eigen::MatrixXd{{first, first}, {0.0, second}};  // of two joints, two postures
  };
  EXPECT_EQ(bundles.add(motion(0.0, 0.0)), 0);
  EXPECT_EQ(bundles.add(motion(0.0, 1.9)), 0) << "0.95 rad apart on average";
  EXPECT_NEAR(bundles.all()[0].mean(1, 1), 0.95, 1e-12);
  EXPECT_EQ(bundles.add(motion(3.0, 0.0)), 1);
  EXPECT_EQ(bundles.add(motion(2.2, 0.0)), 1) << "the nearer one";
  EXPECT_EQ(bundles.add(motion(-3.0, 0.0)), -1) << "no place is left";
  EXPECT_EQ(bundles.add(Eigen::MatrixXd::Zero(3, 2)), -1) << "another arm's";
  EXPECT_EQ(bundles.all()[1].motions, 2);
}

TEST(Imitator, GoalsHaveShares) {
  const auto shares = expected_goals(parse_goals({"low=0.25", "high"}));
  EXPECT_DOUBLE_EQ(shares[0], 2.0 * 0.75 / 1.25);
  EXPECT_DOUBLE_EQ(shares[1], 2.0 * 0.25 / 0.75);
  EXPECT_EQ(expected_goals(parse_goals({"high", "low"})), (std::array{1.0, 1.0}));
  EXPECT_EQ(expected_goals(parse_goals({"low"})), (std::array{0.0, 4.0 / 3.0}));
  EXPECT_EQ(expected_goals({}), (std::array{0.0, 0.0}));
  for (const std::vector<std::string>& wrong :
       std::vector<std::vector<std::string>>{{"middle"},
                                             {"high", "high"},
                                             {"high="},
                                             {"high=1.2"},
                                             {"high=nan"},
                                             {"high=0.7", "low=0.4"}}) {
    EXPECT_THROW(Imitator({.goals = wrong}, load_network()), ConfigError) << wrong[0];
  }
}

}  // namespace
}  // namespace mimesis::cognition
