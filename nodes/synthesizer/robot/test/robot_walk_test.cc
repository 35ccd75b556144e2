#include "nodes/synthesizer/robot/robot_walk.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "common/math/circle.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kDt = 0.005;

/// A robot that takes over the wished velocities at each step, and stops a step after the order.
class SlowRobot {
 public:
  RobotFeedback feedback() const {
    RobotFeedback f;
    f.gait = stepping_ ? RobotGait::walking : RobotGait::standing;
    f.pelvis_W_m << p, 0.65;
    f.pelvis_W_m.y() += stepping_ ? 0.03 * std::sin(std::numbers::pi * phase_) : 0.0;  // sways
    f.heading_rad = heading;
    f.swing = left_ ? mocap::kLeft : mocap::kRight;
    f.to_landing_s = stepping_ ? 0.8 * (1.0 - phase_) : 0.0;
    return f;
  }
  void step(const RobotWalk& walk) {
    if (!stepping_ && !walk.stands()) stepping_ = true;
    if (!stepping_) return;
    phase_ += kDt / 0.8;
    if (phase_ >= 1.0) {
      phase_ = 0.0;
      left_ = !left_;
      v_ = walk.velocity();
      if (walk.stands()) {
        if (last_) stepping_ = false;
        last_ = true;
        v_.setZero();
      } else {
        last_ = false;
      }
    }
    p += kDt * (Eigen::Rotation2Dd(heading) * v_.head<2>());
    heading = math::wrap_pi(heading + kDt * v_[2]);
  }
  bool stepping() const { return stepping_; }
  Eigen::Vector2d p = Eigen::Vector2d::Zero();
  double heading = 0.0;

 private:
  bool stepping_ = false, left_ = false, last_ = false;
  double phase_ = 0.0;
  Eigen::Vector3d v_ = Eigen::Vector3d::Zero();
};

TEST(RobotWalk, LeadsARobotToGoalsAllAround) {
  for (int k = 0; k < 12; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / 12 - std::numbers::pi,
                 far = k % 3 == 0 ? 0.3 : 1.5;
    const Eigen::Vector2d goal = far * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    RobotWalk walk({}, 0.1, 20.0, kDt);
    SlowRobot robot;
    walk.walk_to(goal);
    Eigen::Vector3d before = Eigen::Vector3d::Zero();
    double reached_s = -1.0;
    for (int i = 0; i < 20000; ++i) {
      const RobotFeedback f = robot.feedback();
      walk.step(&f);
      robot.step(walk);
      const Eigen::Vector3d v = walk.velocity();
      ASSERT_LE(std::abs(v[0]), 0.3 + 1e-12);
      ASSERT_LE(std::abs(v[1]), 0.1 + 1e-12);
      ASSERT_LE(std::abs(v[2]), 0.15 + 1e-12);
      ASSERT_LE((v - before).cwiseAbs().maxCoeff(), 0.25 * kDt + 1e-12);
      before = v;
      if (walk.reached() && reached_s < 0.0) reached_s = kDt * i;
    }
    EXPECT_GT(reached_s, 0.0) << "goal " << k;
    EXPECT_TRUE(walk.reached());
    EXPECT_FALSE(robot.stepping());
    EXPECT_LT((robot.p - goal).norm(), 0.1) << "goal " << k;
    EXPECT_FALSE(walk.stuck());
  }
}

TEST(RobotWalk, GoesOnAsItIsTold) {
  RobotWalk walk({}, 0.1, 20.0, kDt);
  SlowRobot robot;
  const auto run = [&](double forward, double heading, double s) {
    for (int i = 0; i < s / kDt; ++i) {
      walk.go_on(forward, heading);
      const RobotFeedback f = robot.feedback();
      walk.step(&f);
      robot.step(walk);
    }
  };
  run(0.2, 0.0, 5.0);
  EXPECT_NEAR(walk.velocity()[0], 0.2, 1e-9);
  EXPECT_EQ(walk.velocity()[1], 0.0);
  EXPECT_TRUE(robot.stepping());
  run(0.9, 0.5, 15.0);
  EXPECT_NEAR(walk.velocity()[0], 0.3, 1e-9) << "what the robot can";
  EXPECT_NEAR(robot.heading, 0.5, 0.02);
  EXPECT_FALSE(walk.stuck());
  run(0.0, 0.5, 6.0);
  EXPECT_FALSE(robot.stepping());
  run(0.2, 0.5, 5.0);
  walk.stop();
  for (int i = 0; i < 1200; ++i) {
    const RobotFeedback f = robot.feedback();
    walk.step(&f);
    robot.step(walk);
  }
  EXPECT_FALSE(robot.stepping());
}

TEST(RobotWalk, StandsUntilItHasAGoal) {
  RobotWalk walk({}, 0.1, 20.0, kDt);
  for (int i = 0; i < 100; ++i) walk.step(nullptr);
  EXPECT_TRUE(walk.stands());
  EXPECT_EQ(walk.velocity().norm(), 0.0);
}

TEST(RobotWalk, WithoutFeedbackBelievesThatTheRobotObeys) {
  RobotWalk walk({}, 0.1, 20.0, kDt);
  walk.place({1.0, -1.0}, 0.5);
  walk.walk_to({2.5, 0.5});
  for (int i = 0; i < 20000 && !walk.reached(); ++i) walk.step(nullptr);
  EXPECT_TRUE(walk.reached());
  EXPECT_LT((walk.position_W_m() - Eigen::Vector2d(2.5, 0.5)).norm(), 0.1);
}

TEST(RobotWalk, TurnsOnTheSpot) {
  RobotWalk walk({}, 0.1, 20.0, kDt);
  SlowRobot robot;
  walk.turn_to(-0.6);
  for (int i = 0; i < 6000 && !walk.reached(); ++i) {
    const RobotFeedback f = robot.feedback();
    walk.step(&f);
    robot.step(walk);
  }
  EXPECT_TRUE(walk.reached());
  EXPECT_NEAR(robot.heading, -0.6, 0.08);
  EXPECT_LT(robot.p.norm(), 0.02);
}

TEST(RobotWalk, TellsThatItComesNoNearer) {
  RobotWalk walk({}, 0.1, 5.0, kDt);
  walk.walk_to({3.0, 0.0});
  const RobotFeedback stays;
  for (int i = 0; i < 900; ++i) walk.step(&stays);
  EXPECT_FALSE(walk.stuck());
  for (int i = 0; i < 200; ++i) walk.step(&stays);
  EXPECT_TRUE(walk.stuck());
  EXPECT_FALSE(walk.reached());
}

TEST(RobotWalk, AStopEndsTheSteps) {
  RobotWalk walk({}, 0.1, 20.0, kDt);
  SlowRobot robot;
  walk.walk_to({5.0, 0.0});
  for (int i = 0; i < 2000; ++i) {
    const RobotFeedback f = robot.feedback();
    walk.step(&f);
    robot.step(walk);
    if (i == 1000) {
      EXPECT_TRUE(robot.stepping());
      walk.stop();
    }
  }
  EXPECT_TRUE(walk.stands());
  EXPECT_FALSE(robot.stepping());
  EXPECT_EQ(walk.velocity().norm(), 0.0);
}

}  // namespace
}  // namespace mimesis::synthesizer
