// Tests of the body during the task: hands, joints, pelvis, feet that are about to land.
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

TEST(BipedSequence, TellsThatAHandGetsNoHold) {
  FakeRobot walker({});
  FakeDrawer furniture(0.51, 0.2);
  furniture.near_m = 0.0;
  auto sequence = BipedDrawerSequence::start(drawer(), {{0.51, 0.0}, 0.2}, walker.now());
  ASSERT_TRUE(sequence.has_value());
  for (int i = 0; i < 1400; ++i) {
    const auto& state = sequence->step(walker.feedback(), furniture.seen());
    walker.step(state);
    furniture.step(walker, state);
  }
  EXPECT_FALSE(sequence->state().done);
  EXPECT_NE(sequence->state().refused.find("left hand"), std::string::npos);
  EXPECT_EQ(sequence->state().opened_m, 0.0);  // it does not pull at nothing
}

TEST(BipedSequence, PullsOnUntilAShortRightArmIsThere) {
  for (const double lacks : {0.0, 0.02, 0.05}) {
    Scene scene{.front_m = 0.51, .depth_m = 0.2};
    scene.trouble.knows_hands = true;
    scene.trouble.right_reach_m = 0.51 - lacks;  // with a drawer that is 0.2 m open
    const Outcome out = play(scene);
    ASSERT_TRUE(out.done) << lacks << ": " << out.refused;
    EXPECT_LT(out.reach_error_m, 0.006);
    EXPECT_NEAR(out.opened_m, 0.2 + lacks, 0.006) << lacks;
  }
  Scene scene{.front_m = 0.51, .depth_m = 0.2};
  scene.trouble.knows_hands = true;
  scene.trouble.right_reach_m = 0.51 - 0.12;
  const Outcome out = play(scene);
  EXPECT_FALSE(out.done);
  EXPECT_NE(out.refused.find("right hand"), std::string::npos);
  EXPECT_LT(out.opened_m, 0.29);
}

TEST(BipedSequence, StepsUpToADrawerThatJumpsAwayFromItsHands) {
  for (const double at : {6.0, 6.6, 7.2}) {  // it stands before it, reaches, pulls
    const Outcome still = play({.front_m = 1.7}),
                  out = play({.front_m = 1.7, .jump_at_s = at, .jump_m = 0.05});
    ASSERT_TRUE(out.done) << at << ": " << out.refused;
    EXPECT_EQ(out.landed.size(), still.landed.size() + 2) << at;
    EXPECT_LT(out.final_m, 0.51 + 0.031) << at;
  }
}

TEST(BipedSequence, JointsMoveAsInTheTrials) {
  const DrawerData& data = testing::biped_data();
  const Eigen::Index joints = drawer().upper.dof(), rows = joints + 3;
  FakeRobot walker({});
  FakeDrawer furniture(1.7, 0.2);
  auto sequence = BipedDrawerSequence::start(drawer(), {{1.7, 0.0}, 0.2}, walker.now());
  ASSERT_TRUE(sequence.has_value());
  int ticks = 0;
  while (!sequence->state().done && sequence->state().time_s < 15.0) {
    const auto& state = sequence->step(walker.feedback(), furniture.seen());
    walker.step(state);
    furniture.step(walker, state);
    if (state.time_s < 2.0 || ++ticks % 10 != 0) continue;  // from the easy posture
    const Eigen::MatrixXd& samples = data.action[state.action].samples;
    for (Eigen::Index j = 0; j < joints; ++j) {
      if (drawer().upper.moved(static_cast<int>(j)).joint.find("gripper") != std::string::npos) {
        continue;  // opens and closes from its present state
      }
      double least = 1e3, most = -1e3;
      const double of = static_cast<double>(samples.cols()) * state.phase_rad / math::kTwoPi;
      for (Eigen::Index t = 0; t < samples.cols(); ++t) {
        const bool near = std::abs(static_cast<double>(t) - of) < 0.2 * double(samples.cols());
        if (!near) continue;
        for (Eigen::Index k = j; k < samples.rows(); k += rows) {
          least = std::min(least, samples(k, t));
          most = std::max(most, samples(k, t));
        }
      }
      EXPECT_GT(state.q[j], least - 0.15) << j << " at " << state.time_s;
      EXPECT_LT(state.q[j], most + 0.15) << j << " at " << state.time_s;
    }
  }
  EXPECT_TRUE(sequence->state().done);
}

TEST(BipedSequence, RightHandDoesNotShakeWithTheDrawer) {
  FakeRobot walker({});
  FakeDrawer furniture(0.51, 0.2);
  furniture.taken_from_m = 1.0;  // not taken
  auto sequence = BipedDrawerSequence::start(drawer(), {{0.51, 0.0}, 0.2}, walker.now());
  ASSERT_TRUE(sequence.has_value());
  double least = 1e3, most = -1e3;
  for (int i = 0; i < 1000; ++i) {
    DrawerSeen seen = *furniture.seen();
    const bool open = seen.opened_m > 0.1;
    // at 20 Hz as a left hand on springs does; and it is 15 mm less open than wished
    const double off = open ? -0.015 + 0.005 * std::sin(2.0 * M_PI * 20.0 * 0.005 * i) : 0.0;
    seen.opened_m += off;
    seen.handle_W_m.x() -= off;
    seen.object_W_m.x() -= off;
    const auto& state = sequence->step(walker.feedback(), &seen);
    walker.step(state);
    furniture.step(walker, state);
    if (i < 700 || !state.hand[1]) continue;
    least = std::min(least, state.hand[1]->p_W_m.x());
    most = std::max(most, state.hand[1]->p_W_m.x());
  }
  EXPECT_LT(most - least, 0.001);
  EXPECT_NEAR(0.5 * (most + least), furniture.seen()->object_W_m.x() + 0.015, 0.0005);
}

TEST(BipedSequence, WishedVelocityHasNoJumps) {
  FakeRobot walker({});
  FakeDrawer furniture(1.7, 0.2);
  auto sequence = BipedDrawerSequence::start(drawer(), {{1.7, 0.0}, 0.2}, walker.now());
  ASSERT_TRUE(sequence.has_value());
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  double fastest = 0.0;
  for (int i = 0; i < 1600; ++i) {
    if (i == 700) furniture.jump(-0.6);  // it stops
    const auto& state = sequence->step(walker.feedback(), furniture.seen());
    walker.step(state);
    furniture.step(walker, state);
    EXPECT_LE((state.velocity - before).cwiseAbs().maxCoeff(), 0.6 * 0.005 + 1e-12) << i;
    before = state.velocity;
    fastest = std::max(fastest, before.x());
  }
  EXPECT_GT(fastest, 0.25);
}

TEST(BipedSequence, AHandIsLedNoFartherThanFourCentimetres) {
  FakeRobot::Trouble trouble;
  trouble.knows_hands = true;
  trouble.hand_error_m = {-0.10, 0.0, 0.0};  // more than can be made up for
  FakeRobot walker(trouble);
  FakeDrawer furniture(0.51, 0.2);
  auto sequence = BipedDrawerSequence::start(drawer(), {{0.51, 0.0}, 0.2}, walker.now());
  ASSERT_TRUE(sequence.has_value());
  double beyond = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const auto& state = sequence->step(walker.feedback(), furniture.seen());
    walker.step(state);
    furniture.step(walker, state);
    if (state.hand[0]) {
      beyond = std::max(beyond, state.hand[0]->p_W_m.x() - furniture.seen()->handle_W_m.x());
    }
  }
  EXPECT_GT(beyond, 0.035);
  EXPECT_LT(beyond, 0.041);
}

TEST(BipedSequence, AHandThatIsCalledBackBrakes) {
  for (const double at : {5.0, 5.2, 5.35}) {  // on its way to the handle, between landings
    FakeRobot walker({});
    FakeDrawer furniture(1.7, 0.2);
    auto sequence = BipedDrawerSequence::start(drawer(), {{1.7, 0.0}, 0.2}, walker.now());
    ASSERT_TRUE(sequence.has_value());
    std::array<std::optional<Eigen::Vector3d>, 2> last;  // last places of the left hand
    double hardest = 0.0, fastest = 0.0;
    for (double t = 0.0; t < 7.0; t += 0.005) {
      if (std::abs(t - at) < 0.0025) furniture.jump(0.6);
      const auto& state = sequence->step(walker.feedback(), furniture.seen());
      walker.step(state);
      std::optional<Eigen::Vector3d> p;
      if (state.hand[0]) p = state.hand[0]->p_W_m - walker.now().pelvis_W_m;
      if (p && last[0] && last[1]) {
        fastest = std::max(fastest, (*p - *last[0]).norm() / 0.005);
        if (std::abs(t - at) < 0.15) {
          hardest = std::max(hardest, (*p - 2.0 * *last[0] + *last[1]).norm() / 2.5e-5);
        }
      }
      last = {p, last[0]};
    }
    EXPECT_GT(fastest, 0.3) << at;
    EXPECT_LT(hardest, 80.0) << at;  // m/s²; within a tick it would be 500
  }
}

TEST(BipedSequence, ADrawerAcrossTheWayIsNotFollowed) {
  auto sequence = BipedDrawerSequence::start(drawer(), {{1.7, 0.0}, 0.2}, FakeRobot({}).now());
  ASSERT_TRUE(sequence.has_value());
  EXPECT_EQ(sequence->set_task({{1.75, 0.10}, 0.2}), "");
  EXPECT_NE(sequence->set_task({{1.7, 0.3}, 0.2}).find("across"), std::string::npos);
  EXPECT_EQ(sequence->task().front_W_m, Eigen::Vector2d(1.75, 0.10));
  FakeDrawer furniture(1.7, 0.2);
  DrawerSeen seen = *furniture.seen();
  seen.front_W_m.y() = 0.3;
  EXPECT_TRUE(sequence->across(seen.front_W_m));
  sequence->step(nullptr, &seen);
  EXPECT_EQ(sequence->task().front_W_m, Eigen::Vector2d(1.75, 0.10));
  seen.front_W_m.y() = -0.05;
  sequence->step(nullptr, &seen);
  EXPECT_EQ(sequence->task().front_W_m, Eigen::Vector2d(1.7, -0.05));
}

TEST(BipedSequence, AFootThatIsAboutToLandDoesNotGoElsewhere) {
  for (const double left_s : {0.45, 0.325, 0.275, 0.21}) {  // time left of its swing
    FakeRobot walker({});
    FakeDrawer furniture(1.9, 0.2);
    auto sequence = BipedDrawerSequence::start(drawer(), {{1.9, 0.0}, 0.2}, walker.now());
    ASSERT_TRUE(sequence.has_value());
    const auto step = [&] {
      const auto& state = sequence->step(walker.feedback(), furniture.seen());
      const Landings wished = state.landing;
      walker.step(state);
      return wished;
    };
    while (walker.now().steps < 2 || walker.now().to_landing_s > left_s) step();
    const Landings before = step();
    furniture.jump(0.01);
    const Landings after = step();
    const double moved = after[0]->p_W_m.x() - before[0]->p_W_m.x();
    if (left_s > 0.3) {
      EXPECT_GT(moved, 5e-5) << left_s;
    } else {
      EXPECT_NEAR(moved, 0.0, 1e-9) << left_s;
    }
    EXPECT_GT(after[1]->p_W_m.x() - before[1]->p_W_m.x(), 5e-5) << left_s;
  }
}

TEST(BipedSequence, PelvisBeginsToMoveWithTheFirstStepAsHalfAWave) {
  FakeRobot walker({});
  auto sequence = BipedDrawerSequence::start(drawer(), {{1.9, 0.0}, 0.2}, walker.now());
  ASSERT_TRUE(sequence.has_value());
  double second = 0.0;  // at the middle of the first action, where the wave is over
  bool quarter = false;
  while (sequence->state().number == 0) {
    const auto& state = sequence->step(walker.feedback(), nullptr);
    walker.step(state);
    if (state.number > 0) break;
    const double phase = state.phase_rad;
    if (phase >= M_PI) {
      second = std::max(second, state.velocity.x());
      continue;
    }
    const double share = 0.5 * (1.0 - std::cos(phase));
    EXPECT_LT(state.velocity.x(), share * 0.30 + 0.006) << phase;
    quarter = quarter || (std::abs(share - 0.5) < 0.05 && state.velocity.x() > 0.08);
  }
  EXPECT_TRUE(quarter);
  EXPECT_NEAR(second, 0.27, 0.04);
}

}  // namespace
}  // namespace mimesis::synthesizer
