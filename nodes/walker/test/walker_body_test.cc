// The body that a tick asks for, against the plan of that tick.
#include <gtest/gtest.h>

#include <cmath>

#include "common/model/files.h"
#include "nodes/walker/pattern/preview_control.h"
#include "nodes/walker/test/closed_loop.h"

namespace mimesis::walker {
namespace {

using testing::biped;
using testing::ClosedLoop;
using testing::ticks;

WalkerWish standing() {
  WalkerWish wish;
  wish.walk.walk = false;
  return wish;
}

/// 10 s³ − 15 s⁴ + 6 s⁵, s at most 1.
double minimum_jerk(double s) {
  s = std::min(s, 1.0);
  return 10.0 * std::pow(s, 3) - 15.0 * std::pow(s, 4) + 6.0 * std::pow(s, 5);
}

/// A walker by plan alone, and the body that it asks for.
class WalkerStart : public ::testing::Test {
 protected:
  static WalkerSettings plan_alone() {
    WalkerSettings settings;
    settings.filter = settings.stabilize = false;
    settings.gait = gait_settings(biped());
    return settings;
  }
  Eigen::Vector3d com(const WalkerOutput& out) {
    kinematics.update(out.X_WB, out.q);
    return kinematics.com();
  }
  robot::Kinematics kinematics{biped().tree};
};

/// Half-sitting's CoM is not above the middle of the feet; nothing but it comes there, in a second,
/// and the planned ZMP stays below it as that of a robot that stands.
TEST_F(WalkerStart, TheCoMComesAboveTheMiddleOfTheFeetByMinimumJerk) {
  Walker walker(biped(), plan_alone());
  const Eigen::Vector2d middle(1.0, 2.0);
  const double yaw = 0.7;
  walker.reset(middle, yaw);
  kinematics.update(biped().X_WB_half_sitting, biped().half_sitting);
  const Eigen::Vector2d off = Eigen::Rotation2Dd(yaw) * Eigen::Vector2d(kinematics.com().head<2>());
  ASSERT_GT(off.norm(), 1e-3) << "nothing to see with this robot";
  Eigen::VectorXd before = biped().half_sitting;
  for (int k = 0; k < ticks(1.5); ++k) {
    const WalkerOutput& out = walker.step(standing(), {});
    const double t_s = k * kTick_s;
    const Eigen::Vector2d expected = middle + (1.0 - minimum_jerk(t_s)) * off;
    ASSERT_LT((out.com.p_W_m - expected).norm(), 1e-9) << t_s;
    ASSERT_LT((out.pattern.zmp_W_m - expected).norm(), 1e-9) << t_s;
    ASSERT_LT((com(out).head<2>() - expected).norm(), 1e-5) << t_s;
    ASSERT_LT((out.q - before).cwiseAbs().maxCoeff(), 1e-3) << t_s;
    before = out.q;
  }
}

TEST_F(WalkerStart, TheCoMComesToTheHeightOfTheGaitByMinimumJerk) {
  WalkerSettings settings = plan_alone();
  settings.gait->com_height_m -= 0.02;
  Walker walker(biped(), settings);
  for (int k = 0; k < ticks(1.5); ++k) {
    const double height_m = com(walker.step(standing(), {})).z(), t_s = k * kTick_s;
    ASSERT_NEAR(height_m, biped().com_height_m - 0.02 * minimum_jerk(t_s), 2e-4) << t_s;
  }
}

TEST_F(WalkerStart, SaysThatTheLegsAreTooShortForTheHeight) {
  for (const bool too_high : {false, true}) {
    WalkerSettings settings = plan_alone();
    settings.filter = true;
    if (too_high) settings.gait->com_height_m += 0.15;
    Walker walker(biped(), settings);
    int limited = 0;
    std::string trouble;
    for (int k = 0; k < ticks(1.5); ++k) {
      const WalkerOutput& out = walker.step(standing(), {});
      limited += out.limited;
      trouble = out.trouble;
      EXPECT_FALSE(out.failed);
    }
    EXPECT_EQ(limited > 100, too_high) << limited;
    EXPECT_EQ(trouble, too_high ? "filter: a leg ahead is too short, and taken to be rigid" : "");
  }
}

TEST_F(WalkerStart, TheFirstTroubleOfATickIsTold) {
  Walker walker(biped(), plan_alone());
  WalkerWish wish = standing();
  wish.upper_body = Eigen::VectorXd::Zero(2);
  EXPECT_EQ(walker.step(wish, {}).trouble,
            "wish: the upper body's posture has the wrong size or is not finite");
  wish.walk.velocity_m_s.x() = NAN;
  EXPECT_EQ(walker.step(wish, {}).trouble, "wish: a velocity or landing is not finite");
  EXPECT_EQ(walker.step(standing(), {}).trouble, "");
}

/// Plan and balance say where CoM and soles are to be; the body that is asked for has them there.
class WalkerBody : public ::testing::Test {
 protected:
  void go(ClosedLoop& loop, double seconds) {
    for (int i = 0; i < ticks(seconds); ++i) {
      testing::swing_upper_body(biped(), swung_s, wish);
      if (swings_arms) swung_s += kTick_s;
      const Sensors& sensors = loop.sense();
      const WalkerOutput& out = loop.walker.step(wish, sensors);
      ASSERT_EQ(out.trouble, "");
      compare(out);
      loop.obey(out);
    }
  }
  void compare(const WalkerOutput& out) {
    kinematics.update(out.X_WB, out.q);
    const Eigen::Vector2d com = out.com.p_W_m + out.stabilizer.com_shift_W_m;
    ASSERT_LT((kinematics.com().head<2>() - com).norm(), 1e-7);
    for (const Side side : robot::kSides) {
      const Eigen::Isometry3d& X_WS = kinematics.X_WL(biped().leg[side].sole);
      ASSERT_TRUE(X_WS.isApprox(out.stabilizer.X_WS[side], 1e-7));
      const Eigen::Isometry3d& planned = out.pattern.foot[side].X_WS;
      feet_led_m = std::max(feet_led_m, (X_WS.translation() - planned.translation()).norm());
    }
    com_led_m = std::max(com_led_m, out.stabilizer.com_shift_W_m.norm());
    filter_m = std::max(filter_m, (out.com.p_W_m - out.pattern.com.p_W_m).norm());
    gait = out.pattern.gait;
  }

  robot::Kinematics kinematics{biped().tree};
  WalkerWish wish = standing();
  bool swings_arms = false;
  double swung_s = 0.0;
  double feet_led_m = 0.0, com_led_m = 0.0, filter_m = 0.0;  // most
  Gait gait = Gait::standing;
};

TEST_F(WalkerBody, IsWhereThePlanAndItsFilterAskForItInAWalk) {
  WalkerSettings settings;
  settings.stabilize = false;
  ClosedLoop loop(biped(), settings);
  loop.walker.reset({3.0, -2.0}, 1.0);
  go(loop, 1.5);
  filter_m = 0.0;
  swings_arms = true;
  wish.walk = {.velocity_m_s = {0.2, 0.0}, .yaw_rate_rad_s = 0.1, .landing = {}, .walk = true};
  go(loop, 6.0);
  EXPECT_EQ(gait, Gait::walking);
  EXPECT_LT(feet_led_m + com_led_m, 1e-7);
  EXPECT_GT(filter_m, 0.001) << "the filter has no say";
}

TEST_F(WalkerBody, IsWhereBalanceLeadsIt) {
  ClosedLoop loop(biped(), {});
  go(loop, 1.5);
  com_led_m = feet_led_m = 0.0;
  loop.robot.tilt = Eigen::AngleAxisd(0.002, Eigen::Vector3d(0.6, 0.8, 0.0));
  go(loop, 0.4);
  EXPECT_GT(com_led_m, 5e-4);
  EXPECT_GT(feet_led_m, 1e-5);
}

TEST_F(WalkerBody, AHandGoalThatIsNoneIsLeftOut) {
  ClosedLoop loop(biped(), {});
  go(loop, 1.5);
  const Eigen::Vector3d before = kinematics.X_WL(biped().hand[kLeft]).translation();
  const Eigen::Vector3d there = before + Eigen::Vector3d(0.1, 0.0, 0.1);
  for (const TaskGoals::Hand& none : {TaskGoals::Hand{.p_W_m = {NAN, 0.0, 0.0}, .share = 1.0},
                                      TaskGoals::Hand{.p_W_m = there, .share = NAN},
                                      TaskGoals::Hand{.p_W_m = there, .share = -0.5},
                                      TaskGoals::Hand{.p_W_m = there, .share = 1.5}}) {
    wish.hand[kLeft] = none;
    go(loop, 0.3);
    EXPECT_LT((kinematics.X_WL(biped().hand[kLeft]).translation() - before).norm(), 1e-3)
        << none.share;
  }
}

}  // namespace
}  // namespace mimesis::walker
