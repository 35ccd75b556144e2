#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/testing/loopback.h"
#include "nodes/synthesizer/synthesizer_node.h"
#include "proto/walker.pb.h"

namespace mimesis::synthesizer {
namespace {

using namespace std::chrono_literals;
using runtime::Time;
constexpr double kPeriod_s = 0.005, kStep_s = 0.8;

SynthesizerParams robot_params() {
  SynthesizerParams p;
  p.model = MIMESIS_SOURCE_DIR "/models/biped_walk.motion.json";
  p.robot.description = "biped.yaml";
  p.character.style = "slow";
  return p;
}

/// A node and a robot that walks as it is wished, with steps of 0.8 s.
class RobotRig {
 public:
  explicit RobotRig(const SynthesizerParams& p = robot_params()) : node_(p, bus) {}

  void run(Time duration) {
    for (const Time end = now_ + duration; now_ < end; now_ += 5ms) {
      if (with_feedback) bus.send("feedback", feedback(), now_);
      node_.step(now_);
      while (auto m = bus.take<v1::Motion>("motion")) motion = *m;
      while (auto s = bus.take<v1::MotionStatus>("status")) statuses.push_back(*s);
      while (auto s = bus.take<v1::MotionStatus>("reached")) reached.push_back(*s);
      if (after_step) after_step();
      walk();
    }
  }
  void command(double step_m, double to_heading) {
    v1::CrowdCommand crowd;
    v1::GaitCommand& gait = *crowd.add_gaits();
    gait.set_phase_rate_rad_s(3.0);  // its rhythm is its own
    gait.set_step_length_m(step_m);
    gait.set_heading_rad(to_heading);
    bus.send("crowd", crowd, now_);
  }
  void go(double to_x, double to_y) {
    v1::MotionGoal goal;
    goal.set_kind(v1::MOTION_GOAL_KIND_WALK_TO);
    goal.mutable_position_in_world_m()->set_x_m(to_x);
    goal.mutable_position_in_world_m()->set_y_m(to_y);
    bus.send("goal", goal, now_);
  }
  v1::WalkFeedback feedback() const {
    v1::WalkFeedback f;
    f.set_state(stepping ? v1::WALK_STATE_WALKING : v1::WALK_STATE_STANDING);
    f.mutable_position_pelvis_in_world_m()->set_x_m(x);
    f.mutable_position_pelvis_in_world_m()->set_y_m(y);
    f.mutable_position_pelvis_in_world_m()->set_z_m(0.65);
    f.set_heading_rad(heading);
    f.set_swing(left ? v1::FOOT_LEFT : v1::FOOT_RIGHT);
    f.set_to_landing_s(stepping ? to_landing : 0.0);
    f.add_feet()->set_foot(v1::FOOT_LEFT);
    f.add_feet()->set_foot(v1::FOOT_RIGHT);
    return f;
  }

  mimesis::testing::Loopback bus;
  bool with_feedback = true;
  std::function<void()> after_step;
  v1::Motion motion;
  std::vector<v1::MotionStatus> statuses, reached;
  // the robot
  bool stepping = false, left = false;
  double x = 0.0, y = 0.0, heading = 0.0, to_landing = kStep_s;

 private:
  void walk() {
    if (!stepping) stepping = !motion.stands();
    if (!stepping) return;
    const double c = std::cos(heading), s = std::sin(heading);
    const double vx = motion.velocity_forward_m_s(), vy = motion.velocity_left_m_s();
    x += kPeriod_s * (c * vx - s * vy);
    y += kPeriod_s * (s * vx + c * vy);
    heading = math::wrap_pi(heading + kPeriod_s * motion.yaw_rate_rad_s());
    to_landing -= kPeriod_s;
    if (to_landing > 1e-9) return;
    to_landing = kStep_s;
    left = !left;
    if (motion.stands()) stepping = false;
  }

  SynthesizerNode node_;
  Time now_ = 1s;
};

TEST(RobotNode, LeadsARobotToAGoalInTheRhythmOfItsSteps) {
  RobotRig rig;
  rig.run(300ms);
  EXPECT_TRUE(rig.motion.stands());
  EXPECT_EQ(rig.motion.action(), "stand");
  rig.go(1.5, 0.6);
  double shoulder_least = 10.0, shoulder_most = -10.0;
  v1::MotionRows rows = *rig.bus.take<v1::MotionRows>("rows");
  const auto shoulder =
      static_cast<int>(std::find(rows.rows().begin(), rows.rows().end(), "left_shoulder_pitch") -
                       rows.rows().begin());
  int walked = 0;
  rig.after_step = [&] {
    ASSERT_LE(std::abs(rig.motion.velocity_forward_m_s()), 0.3 + 1e-9);
    ASSERT_EQ(rig.motion.velocity_forward_m_s(), rig.motion.smooth_velocity_forward_m_s());
    ASSERT_EQ(rig.motion.landings_size(), 0);
    if (rig.motion.action() != "walk" || ++walked < 600) return;  // three seconds to come into step
    const double robot =
        (rig.left ? std::numbers::pi : 0.0) + std::numbers::pi * (1.0 - rig.to_landing / kStep_s);
    ASSERT_LT(std::abs(math::wrap_pi(rig.motion.phase_rad() - robot)), 0.35);
    shoulder_least = std::min(shoulder_least, rig.motion.position_rad(shoulder));
    shoulder_most = std::max(shoulder_most, rig.motion.position_rad(shoulder));
  };
  rig.run(25s);
  EXPECT_GT(walked, 600);
  EXPECT_GT(shoulder_most - shoulder_least, 0.05);  // its arms swing
  EXPECT_TRUE(rig.motion.stands());
  EXPECT_EQ(rig.motion.action(), "stand");
  EXPECT_LT(std::hypot(rig.x - 1.5, rig.y - 0.6), 0.15);
  ASSERT_EQ(rig.reached.size(), 1U);
  EXPECT_EQ(rig.motion.velocity_forward_m_s(), 0.0);
}

TEST(RobotNode, WalksAsTheCrowdWishesAndStandsWithoutIt) {
  RobotRig rig;
  for (int k = 0; k < 300; ++k) {
    rig.command(0.16, 0.3);
    rig.run(40ms);
  }
  EXPECT_NEAR(rig.motion.velocity_forward_m_s(), 0.16 / kStep_s, 1e-6);
  EXPECT_NEAR(rig.heading, 0.3, 0.03);
  EXPECT_NEAR(rig.motion.phase_rate_rad_s(), std::numbers::pi / kStep_s, 0.2);
  EXPECT_TRUE(rig.statuses.empty()) << "it has no goal";
  rig.run(6s);  // the crowd is silent
  EXPECT_TRUE(rig.motion.stands());
  EXPECT_FALSE(rig.stepping);
  rig.go(rig.x + 1.0, rig.y);
  for (int k = 0; k < 50; ++k) {
    rig.command(0.0, 0.3);
    rig.run(40ms);
  }
  EXPECT_TRUE(rig.stepping) << "a goal goes before it";
}

TEST(RobotNode, JointsAreSlowEnough) {
  RobotRig rig;
  rig.go(1.0, 0.0);
  double most = 0.0;
  rig.after_step = [&] {
    for (int r = mocap::kBodyRows; r < rig.motion.velocity_rad_s_size(); ++r) {
      most = std::max(most, std::abs(rig.motion.velocity_rad_s(r)));
    }
  };
  rig.run(10s);
  EXPECT_GT(most, 0.05);
  EXPECT_LT(most, 3.0);
}

TEST(RobotNode, WithoutFeedbackItBelievesThatTheRobotObeys) {
  RobotRig rig;
  rig.with_feedback = false;
  rig.go(1.0, 0.3);
  rig.run(20s);
  ASSERT_EQ(rig.reached.size(), 1U);
  EXPECT_LT(std::hypot(rig.x - 1.0, rig.y - 0.3), 0.2);
}

TEST(RobotNode, ComesBackFromWhereTheRobotIsPushedTo) {
  RobotRig rig;
  rig.go(1.0, 0.0);
  rig.run(4s);
  rig.y += 0.4;
  rig.run(25s);
  EXPECT_LT(std::hypot(rig.x - 1.0, rig.y), 0.15);
}

TEST(RobotNode, BadFeedbackIsAsNone) {
  RobotRig rig;
  rig.with_feedback = false;
  rig.go(1.0, 0.0);
  int k = 0;
  rig.after_step = [&] {
    v1::WalkFeedback f = rig.feedback();
    switch (k++ % 7) {
      case 0:
        f.set_state(static_cast<v1::WalkState>(77));
        break;
      case 1:
        f.mutable_position_pelvis_in_world_m()->set_x_m(1e9);
        break;
      case 2:
        f.set_to_landing_s(-1.0);
        break;
      case 3:
        f.mutable_feet()->RemoveLast();
        break;
      case 4:
        f.mutable_feet(0)->set_foot(v1::FOOT_RIGHT);
        break;
      case 5:
        f.add_hands_in_world_m();
        break;
      default:
        f.set_to_landing_s(0.3);
        f.set_swing(v1::FOOT_UNSPECIFIED);
    }
    rig.bus.send("feedback", f, Time(1s) + k * 5ms);
    ASSERT_LT(std::abs(rig.motion.position_pelvis_in_world_m().x_m()), 2.0);
  };
  rig.run(15s);
  EXPECT_EQ(rig.reached.size(), 1U);
}

TEST(RobotNode, ALostFeedbackIsSaidAndTheWalkGoesOn) {
  RobotRig rig;
  rig.go(2.0, 0.0);
  rig.run(3s);
  rig.with_feedback = false;
  rig.run(20s);
  EXPECT_EQ(rig.reached.size(), 1U);
}

TEST(RobotNode, GoesToADrawerByLandings) {
  SynthesizerParams p = robot_params();
  p.drawer = true;
  RobotRig rig(p);
  rig.with_feedback = false;  // it is believed to obey
  v1::MotionGoal goal;
  goal.set_kind(v1::MOTION_GOAL_KIND_DRAWER);
  goal.mutable_position_in_world_m()->set_x_m(1.7);
  goal.set_object_depth_m(0.2);
  rig.bus.send("goal", goal, 1s);
  std::vector<std::string> actions;
  std::vector<double> before;
  int hands = 0;
  rig.after_step = [&] {
    const v1::Motion& m = rig.motion;
    if (actions.empty() || actions.back() != m.action()) actions.push_back(m.action());
    if (m.action() == "step") {
      ASSERT_EQ(m.landings_size(), 2);
      EXPECT_NE(m.landings(0).foot(), m.landings(1).foot());
    }
    hands = std::max(hands, m.hands_size());
    const std::vector<double> now(m.position_rad().begin(), m.position_rad().end());
    for (std::size_t r = 51; r < before.size(); ++r) ASSERT_LT(std::abs(now[r] - before[r]), 0.03);
    before = now;
  };
  rig.run(10s);
  EXPECT_EQ(actions, (std::vector<std::string>{"step", "reach", "take"}));
  EXPECT_EQ(hands, 2);
  EXPECT_TRUE(rig.motion.stands());
  ASSERT_EQ(rig.reached.size(), 1U);
  EXPECT_EQ(rig.reached[0].kind(), v1::MOTION_GOAL_KIND_DRAWER);
  rig.go(0.0, 0.0);  // the goal leaves again: the arms come back without a jump
  rig.run(2s);
  EXPECT_EQ(rig.motion.hands_size(), 0);
}

TEST(RobotNode, RefusesADrawerWithoutItsActions) {
  RobotRig rig;
  v1::MotionGoal goal;
  goal.set_kind(v1::MOTION_GOAL_KIND_DRAWER);
  goal.mutable_position_in_world_m()->set_x_m(1.7);
  rig.bus.send("goal", goal, 1s);
  rig.run(100ms);
  ASSERT_FALSE(rig.statuses.empty());
  EXPECT_NE(rig.statuses[0].reason().find("drawer"), std::string::npos);
}

TEST(RobotNode, IsOneRobot) {
  SynthesizerParams p = robot_params();
  p.characters = 2;
  mimesis::testing::Loopback bus;
  EXPECT_THROW(SynthesizerNode(p, bus), ConfigError);
}

}  // namespace
}  // namespace mimesis::synthesizer
