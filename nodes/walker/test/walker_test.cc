#include "nodes/walker/walker.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/testing/no_malloc.h"
#include "nodes/walker/test/closed_loop.h"
#include "nodes/walker/walk_wish.h"

namespace mimesis::walker {
namespace {

using testing::biped;
using testing::ClosedLoop;
using testing::kNan;
using testing::ticks;

struct Chain {
  PatternKind pattern;
  int iterations;
  const char* name;
};

class WholeTick : public ::testing::TestWithParam<Chain> {
 protected:
  WalkerSettings settings() const {
    WalkerSettings s;
    s.pattern = GetParam().pattern;
    s.filter_settings.iterations = GetParam().iterations;
    return s;
  }
};

/// A motion for every tick: walks with swinging arms, reaches with both hands, wishes its upper
/// body and its velocity beyond the limits, then stops.
void motion_at(double t_s, MotionWish& motion) {
  WalkerWish upper;
  testing::swing_upper_body(biped(), t_s, upper);
  motion.velocity_m_s = {t_s < 5.0 ? 0.25 : 2.0, 0.0};
  motion.yaw_rate_rad_s = 0.1;
  motion.stands = t_s > 7.0;
  motion.upper_body = upper.upper_body;
  motion.upper_body_rate = upper.upper_body_rate;
  if (t_s > 5.0 && t_s < 6.5) motion.upper_body.array() += 4.0;
  motion.hand = {};
  if (t_s < 2.0 || t_s > 5.0) return;
  for (const Side side : robot::kSides) {
    motion.hand[side] = {.p_W_m = {0.25 * t_s + 0.5, robot::sign(side) * 0.3, 1.0},
                         .share = std::min(1.0, t_s - 2.0)};
  }
}

TEST_P(WholeTick, DoesNotAllocate) {
  ClosedLoop loop(biped(), settings());
  WalkWish wish(biped(), gait_settings(biped()), {});
  MotionWish motion;
  GroundPose place;
  bool clipped = false, walked = false, limited_posture = false;
  for (int i = 0; i < ticks(11.0); ++i) {
    const double t_s = i * kTick_s;
    motion_at(t_s, motion);
    if (t_s > 10.5) loop.robot.tilt = Eigen::AngleAxisd(1.5, Eigen::Vector3d::UnitX());  // fallen
    Sensors sensors = loop.sense();
    if (t_s > 9.5 && t_s < 9.7) sensors.q[3] = kNan;  // blind
    const WalkerOutput* out = nullptr;
    if (i == 0) {
      out = &loop.walker.step(wish.step(&motion, place, kTick_s), sensors);
    } else {
      const mimesis::testing::NoMalloc guard;
      out = &loop.walker.step(wish.step(&motion, place, kTick_s), sensors);
    }
    clipped = clipped || !wish.clipped().empty();
    walked = walked || out->pattern.gait == Gait::walking;
    limited_posture = limited_posture || out->clipped;
    EXPECT_FALSE(out->failed) << t_s << ": " << out->trouble;
    if (t_s < 9.5) {
      EXPECT_EQ(out->stabilizer.reason, "") << t_s;
    }
    loop.obey(*out);
    place = {.p_W_m = 0.5 * (out->pattern.foot[kLeft].X_WS.translation() +
                             out->pattern.foot[kRight].X_WS.translation())
                                .head<2>(),
             .yaw_rad = out->pattern.yaw_rad};
    if (i == ticks(9.4)) {
      EXPECT_EQ(out->pattern.gait, Gait::standing);
    }
    if (i == ticks(9.6)) {
      EXPECT_NE(out->trouble, "");
    }
    if (i == ticks(10.9)) {
      EXPECT_TRUE(out->stabilizer.falling) << "of " << out->stabilizer.reason;
    }
  }
  EXPECT_TRUE(clipped && walked && limited_posture);
  EXPECT_EQ(loop.fault, "");
}

INSTANTIATE_TEST_SUITE_P(All, WholeTick,
                         ::testing::Values(Chain{PatternKind::linear, 1, "linear_1"},
                                           Chain{PatternKind::linear, 2, "linear_2"},
                                           Chain{PatternKind::nonlinear, 1, "nonlinear_1"},
                                           Chain{PatternKind::nonlinear, 2, "nonlinear_2"},
                                           Chain{PatternKind::preview, 1, "preview_1"}),
                         [](const auto& chain) { return chain.param.name; });

/// Where links are after `seconds` of standing with one wished upper body.
class WalkerGoals : public ::testing::Test {
 protected:
  void stand(const WalkerWish& wish, double seconds) {
    for (int i = 0; i < ticks(seconds); ++i) {
      const Sensors& sensors = loop.sense();
      out = &loop.walker.step(wish, sensors);
      ASSERT_EQ(out->trouble, "");
      loop.obey(*out);
    }
    kinematics.update(out->X_WB, out->q);
  }
  WalkerWish with(std::string_view joint, double rad) const {
    WalkerWish wish;
    wish.walk.walk = false;
    Eigen::VectorXd q = biped().half_sitting;
    q[biped().tree.require_joint(joint)] = rad;
    wish.upper_body = q(biped().upper_body);
    return wish;
  }
  Eigen::Matrix3d trunk() const { return kinematics.X_WL(biped().trunk).linear(); }

  ClosedLoop loop{biped(), {}};
  robot::Kinematics kinematics{biped().tree};
  const WalkerOutput* out = nullptr;
};

TEST_F(WalkerGoals, TheTrunkIsAsTheWaistTurnsItAboveAnUprightPelvis) {
  stand(with("waist_yaw", 0.3), 3.0);
  const Eigen::Matrix3d yaw = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_LT((trunk() - yaw).norm(), 5e-3) << trunk();
  stand(with("waist_pitch", 0.2), 3.0);
  const Eigen::Matrix3d pitch = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()).toRotationMatrix();
  EXPECT_LT((trunk() - pitch).norm(), 5e-3) << trunk();
}

TEST_F(WalkerGoals, TheTrunkTurnsWithTheWayOfTheRobot) {
  loop.walker.reset({0.0, 0.0}, 0.0);
  WalkerWish wish;
  wish.walk.yaw_rate_rad_s = 0.2;
  for (int i = 0; i < ticks(6.0); ++i) {
    const Sensors& sensors = loop.sense();
    out = &loop.walker.step(wish, sensors);
    loop.obey(*out);
  }
  kinematics.update(out->X_WB, out->q);
  ASSERT_GT(out->pattern.yaw_rad, 0.5);
  EXPECT_NEAR(std::atan2(trunk()(1, 0), trunk()(0, 0)), out->pattern.yaw_rad, 0.02);
}

TEST_F(WalkerGoals, AWholeHandIsWhereItIsWished) {
  WalkerWish wish;
  wish.walk.walk = false;
  stand(wish, 1.0);
  const Eigen::Vector3d there =
      kinematics.X_WL(biped().hand[kLeft]).translation() + Eigen::Vector3d(0.1, 0.05, 0.1);
  wish.hand[kLeft] = {.p_W_m = there, .share = 1.0};
  stand(wish, 3.0);
  EXPECT_LT((kinematics.X_WL(biped().hand[kLeft]).translation() - there).norm(), 1e-3);
}

}  // namespace
}  // namespace mimesis::walker
