#include "nodes/synthesizer/robot/biped_sequence.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "nodes/synthesizer/robot/test/played.h"

namespace mimesis::synthesizer {
namespace {

using testing::drawer;
using testing::FakeDrawer;
using testing::FakeRobot;
using testing::Outcome;
using testing::play;
using testing::Scene;

TEST(BipedSequence, DoesTheTaskAtEveryDistance) {
  for (int k = 0; k <= 60; ++k) {
    Scene scene;
    scene.front_m = 0.50 + 0.05 * k;
    scene.depth_m = 0.124 + 0.149 * (k % 5) / 4.0;
    const Outcome out = play(scene);
    ASSERT_TRUE(out.done) << "front at " << scene.front_m << ": " << out.refused;
    EXPECT_TRUE(out.refused.empty());
    const double comfort = 0.663 + 0.617 * (scene.depth_m - 0.124) - scene.depth_m;
    EXPECT_NEAR(out.final_m, comfort, 0.055) << "front at " << scene.front_m;
    EXPECT_LT(out.reach_error_m, 0.005);
    EXPECT_LT(out.most_speed, 0.6);      // share of the joints' largest speed
    EXPECT_LT(out.most_rate_jump, 0.4);  // rad/s in a step of 5 ms: 80 rad/s²
    for (std::size_t i = 1; i < out.landed.size(); ++i) {
      const SolePrint &a = out.landed[i - 1], &b = out.landed[i];
      EXPECT_NE(a.side, b.side);
      EXPECT_LE(b.p_W_m.x() - a.p_W_m.x(), 0.2801);
      EXPECT_GE(b.p_W_m.x() - a.p_W_m.x(), -1e-9);
    }
    if (!out.landed.empty()) {
      EXPECT_EQ(out.landed.front().side, mocap::kRight);
      EXPECT_EQ(out.landed.back().side, mocap::kLeft);
      EXPECT_NEAR(out.landed.back().p_W_m.x(), out.landed[out.landed.size() - 2].p_W_m.x(), 1e-9);
    }
  }
}

TEST(BipedSequence, FourActionsHaveThePublishedLengths) {
  const Outcome out = play({.front_m = 1.70});
  ASSERT_TRUE(out.done);
  ASSERT_EQ(out.history.size(), 4U);
  EXPECT_EQ(out.history[0].action, kNormalStep);  // from side by side: three quarters of it
  EXPECT_EQ(out.history[1].action, kNormalStep);
  EXPECT_EQ(out.history[2].action, kReachingStep);
  EXPECT_EQ(out.history[3].action, kStanding);
  EXPECT_NEAR(out.history[0].length_m, 0.75 * out.history[1].length_m, 1e-6);
  EXPECT_GE(out.history[1].length_m, 0.505);  // [M18 3.8.4]
  EXPECT_LE(out.history[1].length_m, 0.561);
  EXPECT_GE(out.history[2].length_m, 0.163);
  EXPECT_LE(out.history[2].length_m, 0.359);
}

TEST(BipedSequence, EachLandingErrorIsMadeUpForInTheNextStep) {
  for (const double along : {-0.01, 0.0, 0.01}) {
    for (const double across : {-0.01, 0.01}) {
      for (const bool same : {false, true}) {
        Scene scene;
        scene.front_m = 1.75;
        scene.trouble = {.along_m = along, .across_m = across, .same_way = same, .late_ticks = 2};
        scene.trouble.knows_hands = true;
        scene.trouble.hand_error_m = {0.01, -0.01, 0.01};
        const Outcome out = play(scene);
        ASSERT_TRUE(out.done) << along << " " << across << " " << same << ": " << out.refused;
        EXPECT_LT(out.reach_error_m, 0.010);
        EXPECT_LT(out.most_rate_jump, 0.4);
        // no error is left behind: the robot stands where its last two steps have it
        EXPECT_NEAR(out.final_m, 0.51, 0.045);
      }
    }
  }
}

TEST(BipedSequence, FollowsALateAndAFastRobotAndOneThatBeginsWithItsLeftFoot) {
  for (const double pace : {0.9, 1.0, 1.2}) {
    for (const int late : {0, 1, 5}) {
      for (const bool left : {false, true}) {
        Scene scene;
        scene.trouble = {.late_ticks = late, .pace = pace, .left_first = left};
        const Outcome out = play(scene);
        ASSERT_TRUE(out.done) << pace << " " << late << " " << left << ": " << out.refused;
        EXPECT_LT(out.most_speed, 0.85);
        EXPECT_LT(out.most_rate_jump, 0.4);
      }
    }
  }
}

TEST(BipedSequence, FollowsADrawerThatJumpsAway) {
  for (const bool seen : {true, false}) {
    for (double at = 0.2; at < 7.0; at += 0.7) {
      for (const double by : {0.05, 0.1, 0.3, 0.8}) {
        Scene scene{.front_m = 1.7, .jump_at_s = at, .jump_m = by, .seen = seen};
        const Outcome out = play(scene);
        ASSERT_TRUE(out.done) << by << " m at " << at << " s: " << out.refused;
        EXPECT_NEAR(out.final_m, 0.51, 0.055) << by << " m at " << at << " s";
        EXPECT_LT(out.most_speed, 0.85) << by << " m at " << at << " s";
        EXPECT_LT(out.most_rate_jump, 0.4) << by << " m at " << at << " s";
        EXPECT_GE(out.actions, by > 0.2 ? 5 : 4) << by << " m at " << at << " s";  // one is put in
      }
    }
  }
}

TEST(BipedSequence, TakesADrawerThatJumpsNearer) {
  int back = 0;
  for (const bool seen : {true, false}) {
    for (double at = 0.2; at < 9.0; at += 0.35) {
      for (const double by : {-0.09, -0.15, -0.25}) {
        Scene scene{.front_m = 1.7, .jump_at_s = at, .jump_m = by, .seen = seen};
        const Outcome out = play(scene);
        ASSERT_TRUE(out.done) << by << " m at " << at << " s: " << out.refused;
        EXPECT_LT(out.most_rate_jump, 0.4) << by << " m at " << at << " s";
        EXPECT_LT(out.most_speed, 0.85) << by << " m at " << at << " s";
        if (out.time_s < at) continue;  // taken before the jump
        EXPECT_GE(out.final_m, 0.51 - 0.081) << by << " m at " << at << " s";
        EXPECT_LE(out.final_m, 0.51 + 0.031) << by << " m at " << at << " s";
        for (std::size_t i = 1; i < out.landed.size(); ++i) {
          const SolePrint &a = out.landed[i - 1], &b = out.landed[i];
          EXPECT_NE(a.side, b.side);
          EXPECT_GE(b.p_W_m.x() - a.p_W_m.x(), -0.1501);
          // feet keep to their sides
          EXPECT_NEAR(std::abs(b.p_W_m.y() - a.p_W_m.y()), 0.19, 1e-6);
          if (b.p_W_m.x() >= a.p_W_m.x() - 1e-6) continue;
          ++back;
          EXPECT_EQ(b.side, mocap::kRight);
          // the right foot was beside the left one
          EXPECT_NEAR(out.landed[i - (i > 1 ? 2 : 1)].p_W_m.x(), a.p_W_m.x(), 1e-6);
        }
      }
    }
  }
  EXPECT_GT(back, 20);
}

TEST(BipedSequence, AHandLeavesADrawerThatCameTooNearBeforeItSinks) {
  FakeRobot walker({});
  FakeDrawer furniture(1.7, 0.2);
  auto sequence = BipedDrawerSequence::start(drawer(), {{1.7, 0.0}, 0.2}, walker.now());
  ASSERT_TRUE(sequence.has_value());
  bool behind = false, left = false;
  for (int i = 0; i < 1300; ++i) {
    if (i == 1080) furniture.jump(-0.12);  // the left hand is about to be at the handle
    const auto& state = sequence->step(walker.feedback(), furniture.seen());
    walker.step(state);
    furniture.step(walker, state);
    const auto& hand = state.hand[mocap::kLeft];
    if (i < 1080 || left) continue;
    ASSERT_TRUE(hand.has_value()) << i;
    const double before_m = furniture.seen()->handle_W_m.x() - hand->p_W_m.x();
    behind = behind || before_m < -0.03;
    left = before_m > 0.04;
    EXPECT_GT(hand->p_W_m.z(), 0.84) << i;  // the front's rim
  }
  EXPECT_TRUE(behind);
  EXPECT_TRUE(left);
}

TEST(BipedSequence, StopsBeforeADrawerThatIsTooNearForStepsBack) {
  for (const double at : {4.0, 6.0, 7.0}) {
    const Outcome out = play({.front_m = 1.7, .jump_at_s = at, .jump_m = -1.1});
    EXPECT_FALSE(out.done);
    EXPECT_NE(out.refused.find("too near"), std::string::npos) << out.refused;
    EXPECT_TRUE(out.stands);
    EXPECT_FALSE(out.hands);  // the hands are not stretched out to an object out of reach
  }
}

TEST(BipedSequence, GoesOnWhenTheDrawerComesBack) {
  FakeRobot walker({});
  FakeDrawer furniture(1.7, 0.2);
  auto sequence = BipedDrawerSequence::start(drawer(), {{1.7, 0.0}, 0.2}, walker.now());
  ASSERT_TRUE(sequence.has_value());
  bool done = false;
  for (int i = 0; i < 5000 && !done; ++i) {
    if (i == 800) furniture.jump(-1.2);
    if (i == 1600) {
      EXPECT_FALSE(sequence->state().refused.empty());
      EXPECT_EQ(walker.now().gait, RobotGait::standing);
      furniture.jump(1.2);
    }
    const auto& state = sequence->step(walker.feedback(), furniture.seen());
    walker.step(state);
    furniture.step(walker, state);
    done = state.done;
  }
  EXPECT_TRUE(done);
}

TEST(BipedSequence, RefusesWhatNoPlanReaches) {
  for (const double front : {0.02, 0.12, 9.0}) {
    const Outcome out = play({.front_m = front});
    EXPECT_FALSE(out.done);
    EXPECT_NE(out.refused.find(front < 1.0 ? "too near" : "farther"), std::string::npos)
        << out.refused;
  }
}

TEST(BipedSequence, WithoutFeedbackTheRobotIsBelievedToObey) {
  Scene scene{.front_m = 2.2, .feedback = false, .seen = false};
  const Outcome out = play(scene);
  EXPECT_TRUE(out.done);
  EXPECT_NEAR(out.time_s, 0.8 + 6 * 0.8 + 1.6 + 2.4, 0.1);
}

TEST(BipedSequence, FeedbackMayFailInTheMidstOfAStep) {
  FakeRobot walker({});
  auto sequence = BipedDrawerSequence::start(drawer(), {{1.7, 0.0}, 0.2}, walker.now());
  ASSERT_TRUE(sequence.has_value());
  Eigen::VectorXd before = sequence->state().q;
  for (int i = 0; i < 2000 && !sequence->state().done; ++i) {
    const bool lost = i > 500 && i < 900;
    const auto& state = sequence->step(lost ? nullptr : walker.feedback(), nullptr);
    walker.step(state);
    EXPECT_LT((state.q - before).cwiseAbs().maxCoeff(), 0.03);
    before = state.q;
  }
  EXPECT_TRUE(sequence->state().done);
}

TEST(BipedSequence, ShiftsItsFeetToADrawerALittleAside) {
  FakeRobot walker({});
  auto sequence = BipedDrawerSequence::start(drawer(), {{1.7, 0.0}, 0.2}, walker.now());
  ASSERT_TRUE(sequence.has_value());
  sequence->set_task({{1.7, 0.10}, 0.2});
  while (!sequence->state().done && sequence->state().time_s < 20.0) {
    walker.step(sequence->step(walker.feedback(), nullptr));
  }
  EXPECT_NEAR(walker.now().feet[mocap::kLeft].p_W_m.y(), 0.195, 1e-6);
  EXPECT_NEAR(walker.now().feet[mocap::kRight].p_W_m.y(), 0.005, 1e-6);
}

TEST(BipedSequence, IsTheSameInAnyDirection) {
  const auto play_towards = [](double heading) {
    const Eigen::Rotation2Dd R(heading);
    const Eigen::Vector2d from(3.0, -2.0);
    auto sequence =
        BipedDrawerSequence::start(drawer(), {from + R * Eigen::Vector2d(1.7, 0.0), 0.2},
                                   standing_robot(from, heading, 0.19, 0.65));
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(drawer().upper.dof());
    for (int i = 0; i < 1700; ++i) sum += sequence->step(nullptr, nullptr).q;
    EXPECT_TRUE(sequence->state().done);
    const Eigen::Vector2d p = R.inverse() * (sequence->robot().pelvis_W_m.head<2>() - from);
    EXPECT_NEAR(p.y(), 0.0, 1e-9);
    return sum;
  };
  EXPECT_LT((play_towards(0.0) - play_towards(2.1)).norm(), 1e-6);
}

TEST(BipedSequence, IsDeterministic) {
  const Outcome a = play({.front_m = 1.7, .jump_at_s = 3.0, .jump_m = 0.3});
  const Outcome b = play({.front_m = 1.7, .jump_at_s = 3.0, .jump_m = 0.3});
  EXPECT_EQ(a.time_s, b.time_s);
  EXPECT_EQ(a.sum_of_q, b.sum_of_q);
  EXPECT_TRUE(a.history == b.history);
}

TEST(BipedSequence, LearnsTheSameAnew) {
  const ActionMaps again(learn_drawer_model(testing::biped_data(), kSevenSources));
  const ActionTask task{.length_m = 0.53, .duration_s = 1.6};
  const MotionParameters a = again.at(kNormalStep, task),
                         b = drawer().actions.at(kNormalStep, task);
  EXPECT_EQ(a.mean_rad, b.mean_rad);
  EXPECT_EQ(a.weight_rad, b.weight_rad);
}

}  // namespace
}  // namespace mimesis::synthesizer
